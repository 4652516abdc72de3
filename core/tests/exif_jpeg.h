#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

namespace oaslam {

struct ExifOptions {
  // 1: upright; 6: to be turned clockwise by 90 degrees; 8: counterclockwise; 3: by 180.
  uint16_t orientation = 1;
  uint16_t focal_length_35mm = 0;  // millimetres, 0: unknown
  bool big_endian = false;
};

// A JPEG file with EXIF metadata (JEITA CP-3451).
inline std::string JpegWithExif(const cv::Mat& image, const ExifOptions& options) {
  std::string tiff;
  const auto put = [&](uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i)
      tiff += static_cast<char>(value >> 8 * (options.big_endian ? bytes - 1 - i : i) & 0xff);
  };
  const auto put_short = [&](uint32_t tag, uint32_t value) {
    put(tag, 2), put(3, 2), put(1, 4), put(value, 2), put(0, 2);
  };
  tiff += options.big_endian ? "MM" : "II";
  put(42, 2), put(8, 4);
  constexpr uint32_t kExifOffset = 8 + 2 + 2 * 12 + 4;
  put(2, 2), put_short(0x0112, options.orientation), put(0x8769, 2), put(4, 2), put(1, 4),
      put(kExifOffset, 4), put(0, 4);
  put(1, 2), put_short(0xa405, options.focal_length_35mm), put(0, 4);
  std::string exif("Exif\0\0", 6);
  exif += tiff;
  const size_t length = exif.size() + 2;
  std::string segment = "\xff\xe1";
  segment += {static_cast<char>(length >> 8), static_cast<char>(length & 0xff)};
  segment += exif;
  std::vector<unsigned char> jpeg;
  cv::imencode(".jpg", image, jpeg);
  const std::string plain(jpeg.begin(), jpeg.end());
  return plain.substr(0, 2) + segment + plain.substr(2);
}

}  // namespace oaslam
