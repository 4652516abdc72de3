#include "oaslam/images/exif_data.h"

#include <vector>

#include "oaslam/images/heif_file.h"
#include "oaslam/images/image_files.h"

namespace oaslam {

ExifBlock LoadExif(const std::string& path) {
  const std::vector<char> bytes = BytesOf(path);
  if (!IsHeif(bytes)) return ExifBlock(exif_data_new_from_file(path.c_str()));
  const std::vector<unsigned char> block = ExifOfHeif(bytes);
  if (block.empty()) return nullptr;
  return ExifBlock(exif_data_new_from_data(block.data(), static_cast<unsigned>(block.size())));
}

std::optional<int> ExifShort(const ExifBlock& data, ExifTag tag) {
  const ExifEntry* entry = data ? exif_data_get_entry(data.get(), tag) : nullptr;
  if (!entry || entry->format != EXIF_FORMAT_SHORT || entry->size < 2) return std::nullopt;
  return exif_get_short(entry->data, exif_data_get_byte_order(data.get()));
}

}  // namespace oaslam
