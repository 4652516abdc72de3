#include "oaslam/images/sensor_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <regex>
#include <string_view>

#include "oaslam/formats/text.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// Numbers in a TIFF file, whose first two letters tell the order of their bytes.
class TiffBytes {
 public:
  explicit TiffBytes(const std::vector<char>& bytes) : bytes_(bytes) {}

  bool IsTiff() const {
    const std::string_view head(bytes_.data(), std::min<size_t>(bytes_.size(), 2));
    return (head == "II" || head == "MM") && Number(2, 2) == 42U;
  }
  // Nothing beyond the end.
  std::optional<uint32_t> Number(size_t at, size_t size) const {
    if (at + size > bytes_.size()) return std::nullopt;
    uint32_t value = 0;
    for (size_t i = 0; i < size; ++i) {
      const size_t place = bytes_[0] == 'M' ? at + i : at + size - 1 - i;
      value = value << 8 | static_cast<uint8_t>(bytes_[place]);
    }
    return value;
  }

 private:
  const std::vector<char>& bytes_;
};

}  // namespace

bool HasRawExtension(const std::string& path) {
  static constexpr std::array kExtensions = {".dng", ".cr2", ".cr3", ".nef", ".arw", ".raf",
                                             ".rw2", ".orf", ".pef", ".srw", ".raw"};
  return std::ranges::find(kExtensions, LowerExtension(path)) != kExtensions.end();
}

bool IsRawTiff(const std::vector<char>& bytes) {
  const TiffBytes tiff(bytes);
  if (!tiff.IsTiff()) return false;
  const std::optional<uint32_t> begin = tiff.Number(4, 4);
  const std::optional<uint32_t> count = begin ? tiff.Number(*begin, 2) : std::nullopt;
  constexpr uint32_t kPhotometric = 262, kColorFilterArray = 32803, kLinearRaw = 34892;
  constexpr uint32_t kDngVersion = 50706;
  for (uint32_t i = 0; i < count.value_or(0); ++i) {
    const size_t entry = size_t{*begin} + 2 + size_t{12} * i;
    const std::optional<uint32_t> tag = tiff.Number(entry, 2), value = tiff.Number(entry + 8, 2);
    if (!tag || !value) return false;
    if (*tag == kDngVersion) return true;
    if (*tag == kPhotometric && (*value == kColorFilterArray || *value == kLinearRaw)) return true;
  }
  return false;
}

bool IsNamedBayer(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().filename().string();
  static const std::regex kEncoding("(^|[^a-z])bayer_(rggb|bggr|gbrg|grbg)(8|16)?([^a-z0-9]|$)");
  const auto is_named = [&](const std::string& name) {
    return std::regex_search(Lower(name), kEncoding);
  };
  return is_named(BaseName(path)) || is_named(folder);
}

bool IsBayerMosaic(const cv::Mat& grey) {
  constexpr int kLeastSide = 16;
  if (grey.channels() != 1 || std::min(grey.cols, grey.rows) < kLeastSide) return false;
  // Neighbours in an image differ by less than pixels further apart, and those of noise by as much.
  constexpr double kMore = 1.5;
  double most = 0;
  cv::minMaxLoc(grey, nullptr, &most);
  const double least = most / 100;  // of the brightest pixel, below which it may be noise
  const auto difference = [&](int dx, int dy) {
    const cv::Rect first(0, 0, grey.cols - dx, grey.rows - dy);
    return cv::norm(grey(first), grey(first + cv::Point(dx, dy)), cv::NORM_L1) / first.area();
  };
  return difference(1, 0) > kMore * difference(2, 0) + least &&
         difference(0, 1) > kMore * difference(0, 2) + least;
}

std::string RefusalOfSensorData(const std::string& path) {
  return fmt::format(
      "{}: is the data of a sensor (Bayer), a colour in each pixel: develop it to JPEG or PNG "
      "first (photos: darktable-cli, dcraw_emu; cameras of robots: image_proc, cv::cvtColor)",
      path);
}

}  // namespace oaslam
