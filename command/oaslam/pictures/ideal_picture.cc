#include "oaslam/pictures/ideal_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {

double IdealPictureMaker::ScaleOf(const Camera& camera) const {
  return std::min(1.0, static_cast<double>(max_side_) / std::max(camera.width, camera.height));
}

cv::Mat IdealPictureMaker::Make(const Camera& camera, const cv::Mat& image) {
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
          const Eigen::Vector2d pixel =
              Distort(camera, {(x + 0.5) / scale - 0.5, (y + 0.5) / scale - 0.5});
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

}  // namespace oaslam
