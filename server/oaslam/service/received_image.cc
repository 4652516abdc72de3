#include "oaslam/service/received_image.h"

#include <cstdint>
#include <opencv2/imgcodecs.hpp>
#include <optional>

#include "oaslam/formats/base64.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

constexpr std::string_view kData = "data:";
constexpr std::string_view kPngStart = "\x89PNG\r\n\x1a\n", kJpegStart = "\xff\xd8\xff";

uint32_t BigEndian(std::string_view bytes, size_t at, size_t count) {
  uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
  return value;
}

// PNG 1.2: the chunk IHDR is the first.
std::optional<cv::Size> SizeOfPng(std::string_view bytes) {
  constexpr size_t kWidth = 16, kHeight = 20;  // where they stand in the file
  if (bytes.size() < kHeight + 4 || bytes.substr(12, 4) != "IHDR") return std::nullopt;
  const uint32_t width = BigEndian(bytes, kWidth, 4), height = BigEndian(bytes, kHeight, 4);
  if (width > INT32_MAX || height > INT32_MAX) return std::nullopt;
  return cv::Size(static_cast<int>(width), static_cast<int>(height));
}

// The scans of a progressive JPEG, each of which costs a decoder a pass over the whole image. Their
// marker does not occur within coded data (ITU T.81, B.1.1.5).
size_t ScansOfJpeg(std::string_view bytes) {
  constexpr std::string_view kScan = "\xff\xda";
  size_t scans = 0;
  for (size_t at = bytes.find(kScan); at != bytes.npos; at = bytes.find(kScan, at + kScan.size()))
    ++scans;
  return scans;
}

// ITU T.81, B.1: segments with their lengths, up to the one that begins the frame.
std::optional<cv::Size> SizeOfJpeg(std::string_view bytes) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(bytes[i]); };
  for (size_t at = 2; at + 9 < bytes.size();) {
    if (byte(at) != 0xff) return std::nullopt;
    const unsigned char marker = byte(at + 1);
    if (marker == 0xff) {  // padding
      ++at;
      continue;
    }
    const bool has_no_length = marker == 0x01 || (marker >= 0xd0 && marker <= 0xd8);
    const bool begins_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (begins_frame)
      return cv::Size(static_cast<int>(BigEndian(bytes, at + 7, 2)),
                      static_cast<int>(BigEndian(bytes, at + 5, 2)));
    if (marker == 0xd9 || marker == 0xda) return std::nullopt;
    at += 2 + (has_no_length ? 0 : BigEndian(bytes, at + 2, 2));
  }
  return std::nullopt;
}

}  // namespace

bool IsDataUrl(std::string_view text) { return Lower(text.substr(0, kData.size())) == kData; }

std::string BytesOfImageText(std::string_view text, const std::string& what) {
  if (!IsDataUrl(text)) {
    std::optional<std::string> bytes = DecodeBase64(text);
    if (!bytes) throw InputError(what + ": is neither base64 nor a data: URL");
    return *std::move(bytes);
  }
  const size_t comma = text.find(',');
  if (comma == std::string_view::npos) throw InputError(what + ": is a data: URL without a comma");
  const std::string_view data = text.substr(comma + 1);
  if (data.empty())
    throw InputError(what + ": is a data: URL without data, as a canvas of no size gives it");
  if (!Lower(text.substr(0, comma)).ends_with(";base64"))
    throw InputError(what + ": is a data: URL, but not of base64");
  const std::optional<std::string> base64 = DecodePercent(data);
  std::optional<std::string> bytes = base64 ? DecodeBase64(*base64) : std::nullopt;
  if (!bytes) throw InputError(what + ": is a data: URL whose base64 is damaged");
  return *std::move(bytes);
}

cv::Size SizeOfReceivedImage(std::string_view bytes) {
  constexpr int64_t kMostPixels = 50'000'000;  // of the largest phone cameras as they save; 150 MB
  constexpr int kLeast = 16, kMost = 16384;  // features need more than the one; a panorama has less
  constexpr size_t kMostScans = 100;         // encoders write about ten
  const bool is_png = bytes.starts_with(kPngStart), is_jpeg = bytes.starts_with(kJpegStart);
  if (!is_png && !is_jpeg) throw InputError("image: is neither a JPEG nor a PNG file");
  const std::optional<cv::Size> size = is_png ? SizeOfPng(bytes) : SizeOfJpeg(bytes);
  if (!size) throw InputError("image: is damaged");
  if (size->width < kLeast || size->height < kLeast || size->width > kMost ||
      size->height > kMost || int64_t{size->width} * size->height > kMostPixels)
    throw BadInput("image: {} x {} pixels, allowed: {} to {} on a side, and {} million in all",
                   size->width, size->height, kLeast, kMost, kMostPixels / 1'000'000);
  if (const size_t scans = is_jpeg ? ScansOfJpeg(bytes) : 0; scans > kMostScans)
    throw BadInput("image: has {} scans, allowed: {}", scans, kMostScans);
  return *size;
}

cv::Mat DecodeReceivedImage(std::string_view bytes, ImageColor color) {
  const cv::Size size = SizeOfReceivedImage(bytes);
  const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<char*>(bytes.data()));
  cv::Mat image;
  try {
    const int flags = color == ImageColor::kGrey ? cv::IMREAD_GRAYSCALE : cv::IMREAD_COLOR;
    image = cv::imdecode(raw, flags | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
  }
  if (image.empty() || image.size() != size) throw InputError("image: is damaged");
  return image;
}

}  // namespace oaslam
