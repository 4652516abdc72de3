#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>
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
// the first images in all four turns. Where the images as they are give the best boxes, that is the
// end of it. Otherwise it goes on to look at images, every half second and later ever more seldom,
// and takes the turn that gives the better boxes in all views so far; it logs each change. It
// prefers not to turn the images. One image at a time.
class TurnedDetector {
 public:
  using Detect = std::function<std::vector<Detection>(const cv::Mat&)>;

  // `turn`: where it is known.
  explicit TurnedDetector(Detect detect, std::optional<int> turn = std::nullopt)
      : detect_(std::move(detect)), turn_(turn.value_or(0)), is_settled_(turn.has_value()) {}

  // In pixels of the image. `timestamp`: seconds, ascending. `known`: the turn of this image, where
  // it is known.
  std::vector<Detection> operator()(const cv::Mat& image, double timestamp,
                                    std::optional<int> known = std::nullopt);
  // The turn by a vertical that is not measured, but follows from how the camera was held. It
  // counts as evidence beside the boxes, unless these have settled the turn.
  void SetHeldTurn(int turn);
  // The turn by all evidence so far; nothing while the first images are looked at.
  std::optional<int> turn() const;
  // Whether the images are turned, but too few views have confirmed it.
  bool is_doubtful() const;

 private:
  using Scores = std::array<double, 4>;  // by turn, sums of the squared scores of all boxes

  std::vector<Detection> DetectIn(const cv::Mat& image, int turn) const;
  bool HasFirst() const;
  void Look(const cv::Mat& image, std::array<std::vector<Detection>, 4>& found);
  double NoveltyOf(const cv::Mat& image);
  void DecideFirst();
  void Decide();
  void Turn(int turn);

  Detect detect_;
  int turn_ = 0;
  bool is_settled_ = false;
  Scores first_{};                  // of the first images, each counted alike
  int looked_at_ = 0, showed_ = 0;  // images; those with a box in any turn
  // Images of the same view say the same again: each image counts by how new its view is.
  Scores sums_{};
  double views_ = 0;           // the sum of these weights, of images with a box
  std::vector<cv::Mat> seen_;  // small images of the views so far
  std::optional<int> held_turn_;
  std::optional<double> begun_s_;  // time of the first image
  double next_s_ = 0;              // when to look again
};

}  // namespace oaslam
