#include "oaslam/viewer/picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {

double PictureMaker::ScaleOf(const Camera& camera) {
  return std::min(1.0, static_cast<double>(kMaxSide) / std::max(camera.width, camera.height));
}

cv::Mat PictureMaker::Make(const Camera& camera, const cv::Mat& image) {
  const double scale = ScaleOf(camera);
  const cv::Size size(std::max(1, static_cast<int>(std::lround(camera.width * scale))),
                      std::max(1, static_cast<int>(std::lround(camera.height * scale))));
  cv::Mat picture;
  if (!camera.HasDistortion()) {
    cv::resize(image, picture, size, 0, 0, cv::INTER_AREA);
  } else {
    if (map_x_.empty() || camera_ != camera) {
      camera_ = camera;
      map_x_.create(size, CV_32F);
      map_y_.create(size, CV_32F);
      for (int y = 0; y < size.height; ++y)
        for (int x = 0; x < size.width; ++x) {
          const Eigen::Vector2d pixel = Distort(camera, {(x + 0.5) / scale - 0.5, (y + 0.5) / scale - 0.5});
          map_x_.at<float>(y, x) = static_cast<float>(pixel.x());
          map_y_.at<float>(y, x) = static_cast<float>(pixel.y());
        }
    }
    cv::remap(image, picture, map_x_, map_y_, cv::INTER_LINEAR);
  }
  if (picture.channels() == 1) cv::cvtColor(picture, picture, cv::COLOR_GRAY2BGR);
  if (picture.channels() == 4) cv::cvtColor(picture, picture, cv::COLOR_BGRA2BGR);
  return picture;
}

std::vector<uint8_t> EncodeJpeg(const cv::Mat& picture, int quality) {
  std::vector<uint8_t> bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, quality});
  return bytes;
}

cv::Mat CutOut(const cv::Mat& picture, double scale, const Box& box, int max_side) {
  constexpr double kMargin = 0.1;  // of the box's sides
  const double dx = kMargin * box.Width(), dy = kMargin * box.Height();
  const auto inside = [](double value, int end) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(end)));
  };
  const int x1 = inside((box.x1 - dx) * scale, picture.cols), x2 = inside((box.x2 + dx) * scale, picture.cols);
  const int y1 = inside((box.y1 - dy) * scale, picture.rows), y2 = inside((box.y2 + dy) * scale, picture.rows);
  constexpr int kMinSide = 8;
  if (x2 - x1 < kMinSide || y2 - y1 < kMinSide) return {};
  cv::Mat cut = picture(cv::Rect(x1, y1, x2 - x1, y2 - y1)).clone();
  const double shrink = static_cast<double>(max_side) / std::max(cut.cols, cut.rows);
  if (shrink < 1) cv::resize(cut, cut, {}, shrink, shrink, cv::INTER_AREA);
  return cut;
}

}  // namespace oaslam
