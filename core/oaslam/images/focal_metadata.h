#pragma once

namespace oaslam {

// Diagonal of the 36 mm x 24 mm frame, to which 35 mm equivalents of focal lengths refer, in
// millimetres.
inline constexpr double kFrameDiagonal35mm = 43.266615305567875;

// Whether a lens may have this 35 mm equivalent (mm). Within these bounds, CheckCalibration accepts
// the focal length for an image of any shape.
inline constexpr bool CanBeFocalLength35mm(double mm) { return mm >= 2 && mm <= 3000; }

}  // namespace oaslam
