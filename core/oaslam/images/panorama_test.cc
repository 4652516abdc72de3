#include "oaslam/images/panorama.h"

#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/imgproc.hpp>

namespace oaslam {
namespace {

// What a sphere of noise, smooth over a few degrees, shows in all directions.
cv::Mat Panorama(int height, uint64_t seed) {
  const int size = 64;
  cv::Mat cube({size, size, size}, CV_32F);
  cv::RNG(seed).fill(cube, cv::RNG::UNIFORM, 0, 255);
  cv::Mat image(height, 2 * height, CV_8U);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      const double latitude = std::numbers::pi * ((y + 0.5) / height - 0.5),
                   longitude = std::numbers::pi * (x + 0.5) / height;
      const auto cell = [&](double v) { return static_cast<int>((v + 1) * (size - 1) / 2); };
      image.at<uchar>(y, x) = cv::saturate_cast<uchar>(
          cube.at<float>(cell(std::cos(latitude) * std::cos(longitude)),
                         cell(std::cos(latitude) * std::sin(longitude)), cell(std::sin(latitude))));
    }
  cv::GaussianBlur(image, image, {3, 3}, 0, 0, cv::BORDER_WRAP);
  return image;
}

cv::Mat Noise(int width, int height) {
  cv::Mat image(height, width, CV_8U);
  cv::RNG(7).fill(image, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(image, image, {5, 5}, 0);
  return image;
}

TEST(Panorama, IsKnownByItsEdges) {
  for (const int height : {128, 256, 512}) {
    const cv::Mat image = Panorama(height, 3);
    EXPECT_TRUE(IsPanorama(image)) << height;
    cv::Mat color;
    cv::cvtColor(image, color, cv::COLOR_GRAY2BGR);
    EXPECT_TRUE(IsPanorama(color)) << height;
  }
}

TEST(Panorama, OtherImagesAreNone) {
  EXPECT_FALSE(IsPanorama(Noise(640, 320)));
  EXPECT_FALSE(IsPanorama(Noise(640, 480)));
  EXPECT_FALSE(IsPanorama(cv::Mat::zeros(320, 640, CV_8U)));
  EXPECT_FALSE(IsPanorama({}));
  // Half a panorama, and one that was cut at its edges.
  const cv::Mat whole = Panorama(256, 5);
  EXPECT_FALSE(IsPanorama(whole.colRange(0, 256)));
  cv::Mat cut;
  cv::resize(whole(cv::Rect(40, 20, 432, 216)), cut, {512, 256});
  EXPECT_FALSE(IsPanorama(cut));
  // Black bars at all sides, and a wall of horizontal lines.
  cv::Mat framed;
  cv::copyMakeBorder(Noise(560, 240), framed, 40, 40, 40, 40, cv::BORDER_CONSTANT);
  EXPECT_FALSE(IsPanorama(framed));
  cv::copyMakeBorder(Noise(640, 240), framed, 40, 40, 0, 0, cv::BORDER_CONSTANT);
  EXPECT_FALSE(IsPanorama(framed));
  cv::Mat lines(320, 640, CV_8U);
  for (int y = 0; y < lines.rows; ++y) lines.row(y) = y / 4 % 2 == 0 ? 40 : 200;
  EXPECT_FALSE(IsPanorama(lines + Noise(640, 320) / 16));
}

}  // namespace
}  // namespace oaslam
