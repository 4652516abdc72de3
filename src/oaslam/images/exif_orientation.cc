#include "oaslam/images/exif_orientation.h"

#include <libexif/exif-data.h>

#include <memory>

namespace oaslam {

std::optional<int> ExifTurn(const std::string& path) {
  const std::unique_ptr<ExifData, decltype(&exif_data_unref)> data(
      exif_data_new_from_file(path.c_str()), &exif_data_unref);
  const ExifEntry* entry = data ? exif_data_get_entry(data.get(), EXIF_TAG_ORIENTATION) : nullptr;
  if (!entry || entry->format != EXIF_FORMAT_SHORT || entry->size < 2) return std::nullopt;
  switch (exif_get_short(entry->data, exif_data_get_byte_order(data.get()))) {
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
