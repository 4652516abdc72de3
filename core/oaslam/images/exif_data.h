#pragma once

#include <libexif/exif-data.h>

#include <memory>
#include <optional>
#include <string>

namespace oaslam {

struct FreeExif {
  void operator()(ExifData* data) const { exif_data_unref(data); }
};
using ExifBlock = std::unique_ptr<ExifData, FreeExif>;

// The EXIF block of a JPEG, HEIC or AVIF file; null where it has none.
ExifBlock LoadExif(const std::string& path);
// The value of a tag of one 16-bit number.
std::optional<int> ExifShort(const ExifBlock& data, ExifTag tag);

}  // namespace oaslam
