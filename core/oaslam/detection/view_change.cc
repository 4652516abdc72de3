#include "oaslam/detection/view_change.h"

#include <algorithm>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace oaslam {
namespace {

// The mean of the cosine's magnitude over all directions: of a motion, gradients in all directions
// measure this share.
constexpr double kMeanCosine = 2 / std::numbers::pi;
// Share of the width, and seconds: what ViewChange::Choose says. The slack is for rounded time
// stamps.
constexpr double kMoved = 0.006 / kMeanCosine;
constexpr double kMostSeconds = 0.15, kTimeSlack = 1e-3;
constexpr int kWidth = 80;              // of the small images, pixels
constexpr double kLeastGradient = 0.5;  // grey levels; less is noise

// Small enough for a motion of some percent to be one or two pixels. The mean brightness does not
// count: cameras adjust it.
cv::Mat Small(const cv::Mat& image) {
  cv::Mat grey = image, small;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  const int height = std::max(image.rows * kWidth / std::max(image.cols, 1), 1);
  cv::resize(grey, small, {kWidth, height}, 0, 0, cv::INTER_AREA);
  small.convertTo(small, CV_32F);
  return small - cv::mean(small)[0];
}

double MeanGradient(const cv::Mat& small) {
  cv::Mat x, y, length;
  cv::Sobel(small, x, CV_32F, 1, 0, 1, 0.5);
  cv::Sobel(small, y, CV_32F, 0, 1, 1, 0.5);
  cv::magnitude(x, y, length);
  return std::max(cv::mean(length)[0], kLeastGradient);
}

double ShareMoved(const cv::Mat& from, double gradient, const cv::Mat& to) {
  cv::Mat difference;
  cv::absdiff(from, to, difference);
  return cv::mean(difference)[0] / gradient / kWidth / kMeanCosine;
}

}  // namespace

bool ViewChange::Choose(const cv::Mat& image, double timestamp) {
  cv::Mat small = Small(image);
  const bool is_new = chosen_.size() != small.size() ||
                      timestamp - chosen_time_ > kMostSeconds - kTimeSlack ||
                      ShareMoved(chosen_, gradient_, small) > kMoved;
  if (!is_new) return false;
  gradient_ = MeanGradient(small);
  chosen_ = std::move(small);
  chosen_time_ = timestamp;
  return true;
}

double ShareMoved(const cv::Mat& from, const cv::Mat& to) {
  const cv::Mat small = Small(from);
  return ShareMoved(small, MeanGradient(small), Small(to));
}

bool HelpsLostCamera(double lost_for_s, double since_last_s, const cv::Mat& last,
                     const cv::Mat& image) {
  constexpr double kOften_s = 0.1, kSeldom_s = 0.5, kLong_s = 5, kStill = 5;
  const double pause_s = (lost_for_s < kLong_s ? kOften_s : kSeldom_s) - kTimeSlack;
  if (since_last_s < pause_s) return false;
  return since_last_s > kStill * pause_s || last.size() != image.size() ||
         ShareMoved(last, image) > kMoved;
}

}  // namespace oaslam
