#include "oaslam/detection/letterbox.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "oaslam/util/check.h"

namespace oaslam {

Letterbox MakeLetterbox(const cv::Mat& bgr, const cv::Size& network_size, Fit fit) {
  OASLAM_CHECK(!bgr.empty() && bgr.type() == CV_8UC3);
  Letterbox result;
  result.scale_x = static_cast<double>(network_size.width) / bgr.cols;
  result.scale_y = static_cast<double>(network_size.height) / bgr.rows;
  if (fit == Fit::kStretched) {
    cv::resize(bgr, result.image, network_size, 0, 0, cv::INTER_LINEAR);
    return result;
  }
  const bool centered = fit == Fit::kCentered;
  const double scale = std::min(result.scale_x, result.scale_y);
  result.scale_x = result.scale_y = scale;
  const auto scaled_size = [&](int size, int bound) {
    // YOLOX truncates the size, YOLOv5 and later round it.
    const double scaled = size * scale;
    return std::clamp(
        static_cast<int>(centered ? std::lround(scaled) : static_cast<long>(scaled + 1e-9)), 1,
        bound);
  };
  const cv::Size inner(scaled_size(bgr.cols, network_size.width),
                       scaled_size(bgr.rows, network_size.height));
  const int left = centered ? (network_size.width - inner.width) / 2 : 0;
  const int top = centered ? (network_size.height - inner.height) / 2 : 0;
  result.left = left;
  result.top = top;
  result.image = cv::Mat(network_size, CV_8UC3, cv::Scalar::all(114));
  cv::Mat target = result.image(cv::Rect(cv::Point(left, top), inner));
  cv::resize(bgr, target, inner, 0, 0, cv::INTER_LINEAR);
  return result;
}

Box FromLetterbox(const Letterbox& letterbox, const Box& box, const cv::Size& image_size) {
  const auto x = [&](double v) {
    return std::clamp((v - letterbox.left) / letterbox.scale_x, 0.0,
                      static_cast<double>(image_size.width));
  };
  const auto y = [&](double v) {
    return std::clamp((v - letterbox.top) / letterbox.scale_y, 0.0,
                      static_cast<double>(image_size.height));
  };
  return {x(box.x1), y(box.y1), x(box.x2), y(box.y2)};
}

std::array<double, 5> FromLetterbox(const Letterbox& letterbox,
                                    const std::array<double, 5>& ellipse) {
  const auto& [cx, cy, width, height, theta] = ellipse;
  const double scale = letterbox.scale_x;
  return {(cx - letterbox.left) / scale, (cy - letterbox.top) / scale, width / scale,
          height / scale, theta};
}

}  // namespace oaslam
