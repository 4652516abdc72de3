#include "oaslam/images/ros_pixels.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "oaslam/images/bit_depth.h"
#include "oaslam/images/quiet_opencv.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

constexpr int kAsItIs = -1;

// An encoding of sensor_msgs/image_encodings.hpp, and how OpenCV converts it.
struct PixelEncoding {
  std::string_view name;
  int type, to_grey, to_bgr;
};
constexpr PixelEncoding kEncodings[] = {
    {"mono8", CV_8UC1, kAsItIs, cv::COLOR_GRAY2BGR},
    {"8UC1", CV_8UC1, kAsItIs, cv::COLOR_GRAY2BGR},
    {"rgb8", CV_8UC3, cv::COLOR_RGB2GRAY, cv::COLOR_RGB2BGR},
    {"bgr8", CV_8UC3, cv::COLOR_BGR2GRAY, kAsItIs},
    {"8UC3", CV_8UC3, cv::COLOR_BGR2GRAY, kAsItIs},
    {"rgba8", CV_8UC4, cv::COLOR_RGBA2GRAY, cv::COLOR_RGBA2BGR},
    {"bgra8", CV_8UC4, cv::COLOR_BGRA2GRAY, cv::COLOR_BGRA2BGR},
    // OpenCV names a mosaic by its second row and column.
    {"bayer_rggb8", CV_8UC1, cv::COLOR_BayerBG2GRAY, cv::COLOR_BayerBG2BGR},
    {"bayer_bggr8", CV_8UC1, cv::COLOR_BayerRG2GRAY, cv::COLOR_BayerRG2BGR},
    {"bayer_gbrg8", CV_8UC1, cv::COLOR_BayerGR2GRAY, cv::COLOR_BayerGR2BGR},
    {"bayer_grbg8", CV_8UC1, cv::COLOR_BayerGB2GRAY, cv::COLOR_BayerGB2BGR},
    {"uyvy", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    {"yuv422", CV_8UC2, cv::COLOR_YUV2GRAY_UYVY, cv::COLOR_YUV2BGR_UYVY},
    {"yuyv", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
    {"yuv422_yuy2", CV_8UC2, cv::COLOR_YUV2GRAY_YUY2, cv::COLOR_YUV2BGR_YUY2},
    {"nv21", CV_8UC1, cv::COLOR_YUV2GRAY_NV21, cv::COLOR_YUV2BGR_NV21},
    {"mono16", CV_16UC1, kAsItIs, cv::COLOR_GRAY2BGR}};

// The rows, each of which may have more bytes in the message than the image is wide.
cv::Mat RowsOf(const RosImage& image, int type) {
  // The colours of nv21 are in half as many rows again.
  const uint64_t rows = image.encoding == "nv21" ? image.height + image.height / 2 : image.height;
  const uint64_t used = uint64_t{image.width} * CV_ELEM_SIZE(type);
  const uint64_t step = image.step == 0 ? used : image.step;
  if (image.width == 0 || rows == 0 || step < used || step > image.data.size() ||
      step * (rows - 1) + used > image.data.size())
    throw BadInput("{} x {} pixels of {} in rows of {} bytes, which {} bytes do not have",
                   image.width, image.height, image.encoding, step, image.data.size());
  cv::Mat copy(static_cast<int>(rows), static_cast<int>(image.width), type);
  for (int y = 0; y < copy.rows; ++y)
    std::ranges::copy(image.data.subspan(step * static_cast<uint64_t>(y), used), copy.ptr(y));
  return copy;
}

cv::Mat Converted(const cv::Mat& rows, int code) {
  if (code == kAsItIs) return rows;
  cv::Mat converted;
  try {
    cv::cvtColor(rows, converted, code);
  } catch (const cv::Exception&) {
    throw BadInput("{} x {} values, which cannot be of that encoding", rows.cols, rows.rows);
  }
  return converted;
}

}  // namespace

cv::Mat PixelsOf(const RosImage& image, bool color, int bits) {
  const auto encoding = std::ranges::find(kEncodings, image.encoding, &PixelEncoding::name);
  if (encoding == std::end(kEncodings)) {
    std::vector<std::string_view> names;
    for (const PixelEncoding& known : kEncodings) names.push_back(known.name);
    throw BadInput("images in the encoding \"{}\", allowed: {}", image.encoding.substr(0, 40),
                   fmt::join(names, ", "));
  }
  const cv::Mat rows = encoding->type == CV_16UC1 ? InEightBits(ValuesOf(image), bits)
                                                  : RowsOf(image, encoding->type);
  return Converted(rows, color ? encoding->to_bgr : encoding->to_grey);
}

cv::Mat PixelsOf(const RosCompressedImage& image, bool color) {
  const std::string format = Lower(image.format);
  for (const char* video : {"compresseddepth", "h264", "h265", "hevc", "av1"})
    if (format.find(video) != std::string::npos)
      throw BadInput("images in the format \"{}\", allowed: JPEG, PNG", image.format.substr(0, 40));
  if (image.data.empty()) return {};
  const QuietOpenCv quiet;
  const cv::Mat bytes(1, static_cast<int>(image.data.size()), CV_8UC1,
                      const_cast<uint8_t*>(image.data.data()));
  const int flags =
      (color ? cv::IMREAD_COLOR : cv::IMREAD_GRAYSCALE) | cv::IMREAD_IGNORE_ORIENTATION;
  try {
    return cv::imdecode(bytes, flags);
  } catch (const cv::Exception&) {
    return {};
  }
}

cv::Mat ValuesOf(const RosImage& image) {
  const int type = image.encoding == "32FC1" ? CV_32FC1 : CV_16UC1;
  cv::Mat values = RowsOf(image, type);
  if (!image.is_big_endian) return values;
  const size_t size = values.elemSize();
  for (size_t i = 0; i < values.total(); ++i)
    std::reverse(values.data + i * size, values.data + (i + 1) * size);
  return values;
}

}  // namespace oaslam
