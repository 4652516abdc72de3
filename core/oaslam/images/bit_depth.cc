#include "oaslam/images/bit_depth.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/error.h"
#include "oaslam/images/heif_file.h"
#include "oaslam/images/image_files.h"
#include "oaslam/images/quiet_opencv.h"
#include "oaslam/images/sensor_data.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

constexpr int kAllBits = 16;

}  // namespace

cv::Mat ReadUnchanged(const std::string& path) {
  const std::vector<char> bytes = BytesOf(path);
  if (bytes.empty() || IsHeif(bytes)) return {};  // which is decoded to 8 bits
  const QuietOpenCv quiet;
  try {
    return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};
  }
}

int UsedBits(const cv::Mat& image) {
  double most = 0;
  cv::minMaxLoc(image.reshape(1), nullptr, &most);
  int bits = 8;
  while (bits < kAllBits && most >= std::ldexp(1, bits)) bits += 2;  // sensors have 8, 10, 12, 14
  return bits;
}

cv::Mat InEightBits(const cv::Mat& image, int bits) {
  // Rounded down, as OpenCV does it.
  cv::Mat result;
  image.convertTo(result, CV_8U, std::ldexp(1, 8 - bits), bits > 8 ? -0.499 : 0);
  return result;
}

int LookAtImages(const std::string& source, const std::vector<std::string>& paths, bool quiet,
                 int least) {
  constexpr size_t kMost = 9;  // images of which the brightest pixel tells
  const size_t count = std::min(paths.size(), kMost);
  int bits = 0;
  for (size_t i = 0; i < count; ++i) {
    const std::string& path = paths[i * (paths.size() - 1) / std::max<size_t>(count - 1, 1)];
    const cv::Mat image = ReadUnchanged(path);
    if (image.empty()) continue;
    if (bits == 0 && image.channels() == 1 && (IsNamedBayer(path) || IsBayerMosaic(image)))
      throw InputError(RefusalOfSensorData(path));
    if (image.depth() != CV_16U) return kAllBits;
    bits = std::max(bits, UsedBits(image));
  }
  if (bits < least || bits == kAllBits) return kAllBits;
  if (!quiet)
    Log(LogLevel::kInfo, "{}: {} of the 16 bits of its images are used, all are scaled by 1/{}",
        source, bits, 1 << (bits - 8));
  return bits;
}

}  // namespace oaslam
