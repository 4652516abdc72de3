#pragma once

#include <opencv2/core.hpp>

namespace oaslam {

// Chooses the images of a sequence in which objects are looked for: where the view has hardly
// changed since the last one, boxes add nothing. Judged by the images alone.
class ViewChange {
 public:
  // Whether the image should be looked at: the first one, those whose view has moved by more than
  // 0.6 % of the image's width since the last chosen one, and one at least every 0.15 seconds,
  // since what is seen longer is better known. `image`: 8-bit, grey or BGR, all of one size;
  // `timestamp`: seconds, ascending.
  bool Choose(const cv::Mat& image, double timestamp);

 private:
  cv::Mat chosen_;       // small, grey
  double gradient_ = 0;  // its mean length, grey levels a pixel
  double chosen_time_ = 0;
};

// By how much the second of two images has moved against the first, as a share of their width: the
// mean difference of grey levels, which is that of brightness constancy, motion times gradient
// (Horn and Schunck 1981). As the gradient has all directions, about two thirds of a motion are
// measured. Only small motions are told apart: large ones give some percent.
double ShareMoved(const cv::Mat& from, const cv::Mat& to);

}  // namespace oaslam
