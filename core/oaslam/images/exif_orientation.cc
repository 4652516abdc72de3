#include "oaslam/images/exif_orientation.h"

#include "oaslam/images/exif_data.h"

namespace oaslam {

std::optional<int> ExifTurn(const std::string& path) {
  switch (ExifShort(LoadExif(path), EXIF_TAG_ORIENTATION).value_or(0)) {
    case 1:
      return 0;
    case 6:
      return 1;
    case 3:
      return 2;
    case 8:
      return 3;
    default:
      return std::nullopt;
  }
}

}  // namespace oaslam
