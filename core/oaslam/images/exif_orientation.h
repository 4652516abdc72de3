#pragma once

#include <optional>
#include <string>

namespace oaslam {

// The number of clockwise quarters, 0 to 3, that bring the stored pixels of an image file upright,
// as its EXIF orientation says; nothing where it has none, or is mirrored.
std::optional<int> ExifTurn(const std::string& path);

}  // namespace oaslam
