#pragma once

#include <libexif/exif-data.h>

#include <memory>
#include <optional>
#include <string>

#include "oaslam/util/free_by.h"

namespace oaslam {

using ExifBlock = std::unique_ptr<ExifData, FreeBy<exif_data_unref>>;

// The EXIF block of a JPEG, HEIC or AVIF file; null where it has none.
ExifBlock LoadExif(const std::string& path);
// The value of a tag of one 16-bit number.
std::optional<int> ExifShort(const ExifBlock& data, ExifTag tag);

}  // namespace oaslam
