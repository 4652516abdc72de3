#include "oaslam/viewer/picture.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace oaslam {

std::vector<uint8_t> EncodeJpeg(const cv::Mat& picture, int quality) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return bytes;
}

cv::Mat CutOut(const cv::Mat& picture, double scale, const Box& box, int max_side) {
  constexpr double kMargin = 0.1;  // of the box's sides, so that its outline is seen
  const double dx = kMargin * box.Width(), dy = kMargin * box.Height();
  const auto inside = [](double value, int end) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(end)));
  };
  const int x1 = inside((box.x1 - dx) * scale, picture.cols),
            x2 = inside((box.x2 + dx) * scale, picture.cols);
  const int y1 = inside((box.y1 - dy) * scale, picture.rows),
            y2 = inside((box.y2 + dy) * scale, picture.rows);
  constexpr int kMinSide = 8;  // pixels; below, nothing can be recognised
  if (x2 - x1 < kMinSide || y2 - y1 < kMinSide) return {};
  cv::Mat cut = picture(cv::Rect(x1, y1, x2 - x1, y2 - y1)).clone();
  const double shrink = static_cast<double>(max_side) / std::max(cut.cols, cut.rows);
  if (shrink < 1) cv::resize(cut, cut, {}, shrink, shrink, cv::INTER_AREA);
  return cut;
}

}  // namespace oaslam
