#pragma once

namespace oaslam {

// Diagonal of the 36 mm x 24 mm frame, to which 35 mm equivalents of focal lengths refer, in
// millimetres.
inline constexpr double kFrameDiagonal35mm = 43.266615305567875;

}  // namespace oaslam
