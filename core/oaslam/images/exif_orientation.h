#pragma once

#include <optional>
#include <string>

namespace oaslam {

// The number of clockwise quarter turns, 0 to 3, that bring the stored pixels of an image file
// upright by its EXIF orientation; nothing where the file has none, or a mirrored one.
std::optional<int> ExifTurn(const std::string& path);

}  // namespace oaslam
