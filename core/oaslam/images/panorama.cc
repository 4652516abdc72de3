#include "oaslam/images/panorama.h"

#include <algorithm>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace oaslam {
namespace {

// How many rows have texture in both columns, and in how many of those the brightness changes the
// same way. Signs alone: the edges of a frame, which both columns may cross, count as few rows.
std::pair<int, int> Agreement(const cv::Mat& grey, int a, int b) {
  constexpr int kNoise = 3;  // grey levels
  int rows = 0, agreeing = 0;
  for (int y = 1; y < grey.rows; ++y) {
    const int change_a = grey.at<uchar>(y, a) - grey.at<uchar>(y - 1, a),
              change_b = grey.at<uchar>(y, b) - grey.at<uchar>(y - 1, b);
    if (std::abs(change_a) <= kNoise || std::abs(change_b) <= kNoise) continue;
    ++rows;
    agreeing += (change_a > 0) == (change_b > 0) ? 1 : 0;
  }
  return {rows, agreeing};
}

// The mean difference between neighbours of a row.
double Texture(const cv::Mat& grey, int y) {
  const cv::Rect left(0, y, grey.cols - 1, 1);
  return cv::norm(grey(left), grey(left + cv::Point(1, 0)), cv::NORM_L1) / left.area();
}

}  // namespace

bool IsPanorama(const cv::Mat& image) {
  constexpr int kLeastHeight = 64;
  if (image.rows < kLeastHeight || image.cols != 2 * image.rows) return false;
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  // By chance half of the rows agree.
  constexpr double kAgreeing = 0.8, kWithTexture = 0.1;
  const auto [rows, agreeing] = Agreement(grey, 0, grey.cols - 1);
  if (rows < kWithTexture * grey.rows || agreeing < kAgreeing * rows) return false;
  // A pole is one point of the scene, stretched over the whole row.
  constexpr double kPole = 0.25;
  const double middle = Texture(grey, grey.rows / 2);
  return std::min(Texture(grey, 0), Texture(grey, grey.rows - 1)) < kPole * middle;
}

}  // namespace oaslam
