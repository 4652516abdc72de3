#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// Detectors are trained on upright images. A turn is the number of clockwise quarter turns, 0 to 3,
// that bring an image upright.

// The turn of an image in which gravity has this direction (OpenCV's axes); nothing where the
// camera looks so far up or down that no side is up.
std::optional<int> UprightTurn(const Eigen::Vector3d& gravity_in_cam);

// Converts what was found in a turned image to pixels of the image, which has this size.
void TurnBack(int turn, const cv::Size& size, std::vector<Detection>& detections);

// A detector for images that may all be turned by the same unknown number of quarters. It looks at
// the first images in all four turns, keeps the turn that gives the better boxes, and logs it. It
// prefers not to turn the images. One image at a time.
class TurnedDetector {
 public:
  using Detect = std::function<std::vector<Detection>(const cv::Mat&)>;

  // `turn`: where it is known.
  explicit TurnedDetector(Detect detect, std::optional<int> turn = std::nullopt)
      : detect_(std::move(detect)), turn_(turn) {}

  // In pixels of the image. `known`: the turn of this image, where it is known.
  std::vector<Detection> operator()(const cv::Mat& image, std::optional<int> known = std::nullopt);
  // Nothing while it is not decided.
  std::optional<int> turn() const { return turn_; }

 private:
  std::vector<Detection> DetectIn(const cv::Mat& image, int turn) const;
  void Decide();

  Detect detect_;
  std::optional<int> turn_;
  std::array<double, 4> sums_{};    // by turn, of the squared scores of all boxes
  int looked_at_ = 0, showed_ = 0;  // images; those with a box in any turn
};

}  // namespace oaslam
