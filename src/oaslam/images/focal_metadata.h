#pragma once

namespace oaslam {

// Diagonal of the 36 mm x 24 mm frame, to which 35 mm equivalents of focal lengths refer, in
// millimetres.
inline constexpr double kFrameDiagonal35mm = 43.266615305567875;

// Whether a lens may have this 35 mm equivalent (mm): with it, an image of any shape has a focal
// length that CheckCalibration accepts.
inline constexpr bool CanBeFocalLength35mm(double mm) { return mm >= 2 && mm <= 3000; }

}  // namespace oaslam
