#pragma once

#include <optional>
#include <string>

namespace oaslam {

// Diagonal of the 36 mm x 24 mm frame, to which 35 mm equivalents of focal lengths refer, in
// millimetres.
inline constexpr double kFrameDiagonal35mm = 43.266615305567875;

// The focal length that a source's metadata states, as 35 mm equivalent in millimetres: that of a
// 36 mm x 24 mm frame with the same angle over its diagonal (CIPA DCG-001). An image of w x h
// pixels then has the focal length f = f35 * sqrt(w^2 + h^2) / kFrameDiagonal35mm pixels if it
// shows the whole sensor. Video is often cropped (another aspect ratio, stabilisation), which makes
// f longer by 5 to 30 %. So it is a start value and no calibration.
//
// `source` is that of OpenImages: of a video its container's tag (that of Apple's devices), of an
// image EXIF's FocalLengthIn35mmFilm (0xA405) in a JPEG file, of a folder or list that of its first
// image. Nothing for a camera, where it is not stated (or as 0, "unknown"), and where the source
// cannot be read: OpenImages reports that.
std::optional<double> FocalLength35mm(const std::string& source);

}  // namespace oaslam
