#include "oaslam/system/repeated_images.h"

#include <cstring>

namespace oaslam {

double RepeatedImages::Add(const cv::Mat& grey, double timestamp) {
  bool is_same = !grey.empty() && grey.size() == last_.size() && grey.type() == last_.type();
  const size_t width = static_cast<size_t>(grey.cols) * grey.elemSize();
  for (int y = 0; is_same && y < grey.rows; ++y)
    is_same = std::memcmp(grey.ptr(y), last_.ptr(y), width) == 0;
  if (is_same) return timestamp - since_;
  grey.copyTo(last_);
  since_ = timestamp;
  return 0;
}

}  // namespace oaslam
