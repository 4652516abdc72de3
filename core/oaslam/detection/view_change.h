#pragma once

#include <opencv2/core.hpp>

namespace oaslam {

// Chooses the images of a sequence in which objects are looked for: where the view has hardly
// changed since the last one, boxes add nothing. Judged by the images alone.
class ViewChange {
 public:
  // Whether the image should be looked at: the first one, those whose view has moved by more than
  // 0.94 % of the image's width since the last chosen one, and one at least every 0.15 seconds,
  // since what is seen longer is better known. `image`: 8-bit, grey or BGR, all of one size;
  // `timestamp`: seconds, ascending.
  bool Choose(const cv::Mat& image, double timestamp);

 private:
  cv::Mat chosen_;       // small, grey
  double gradient_ = 0;  // its mean length, grey levels a pixel
  double chosen_time_ = 0;
};

// By how much the second of two images has moved against the first, as a share of their width. By
// constancy of brightness (Horn and Schunck 1981) a grey level changes by motion times gradient;
// over gradients in all directions, the mean change is 2/pi of the motion times their mean length.
// Where all have one direction, up to pi/2 of the motion is measured, or nothing. Only small
// motions are measured: for any large motion the result is a few percent.
double ShareMoved(const cv::Mat& from, const cv::Mat& to);

// Whether a detector should look at an image of a lost camera, for which a few views of objects
// suffice: ten times a second, twice a second after five seconds of being lost, and a fifth as
// often while the view is still that of `last`, the image that the detector looked at last. Times
// in seconds of the time stamps.
bool HelpsLostCamera(double lost_for_s, double since_last_s, const cv::Mat& last,
                     const cv::Mat& image);

}  // namespace oaslam
