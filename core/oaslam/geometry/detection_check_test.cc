#include "oaslam/geometry/detection_check.h"

#include <gtest/gtest.h>

#include <limits>

#include "matchers.h"

namespace oaslam {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

Detection Good() { return {.category_id = 41, .score = 0.8, .box = {-10.5, 2, 3, 4.25}}; }

TEST(DetectionCheck, WhatADetectorGivesPasses) {
  EXPECT_THAT(ProblemOf(Good()), IsEmpty());
  for (const double score : {0.0, 1.0, 1.0 + 1e-7}) {
    Detection detection = Good();
    detection.score = score;
    EXPECT_THAT(ProblemOf(detection), IsEmpty()) << score;
  }
  Detection with_ellipse = Good();
  with_ellipse.ellipse = {15, 20, 10, 12, -0.5};
  EXPECT_THAT(ProblemOf(with_ellipse), IsEmpty());
}

TEST(DetectionCheck, BadBoxesAreNamed) {
  for (const Box& box :
       {Box{5, 0, 1, 9}, Box{0, 9, 4, 9}, Box{kNaN, 0, 1, 1}, Box{0, kNaN, 1, 1},
        Box{0, 0, kNaN, 1}, Box{0, 0, 1, kNaN}, Box{0, 0, 1e7, 9}, Box{-kInfinity, 0, 1, 9}}) {
    Detection detection = Good();
    detection.box = box;
    EXPECT_THAT(ProblemOf(detection), HasSubstr("box: [")) << box.x1 << " " << box.x2;
  }
  EXPECT_THAT(ProblemOfBox({5, 0, 1, 9}), AllOf(HasSubstr("[5, 0, 1, 9]"), HasSubstr("x1 < x2")));
  EXPECT_THAT(ProblemOfBox({0, 0, kNaN, 9}), AllOf(HasSubstr("nan"), HasSubstr("100000")));
}

TEST(DetectionCheck, BadCategoriesScoresAndEllipsesAreNamed) {
  Detection detection = Good();
  detection.category_id = -1;
  EXPECT_THAT(ProblemOf(detection), HasSubstr("category_id: -1"));
  for (const double score : {-0.1, 1.8, kNaN, kInfinity}) {
    detection = Good();
    detection.score = score;
    EXPECT_THAT(ProblemOf(detection), AllOf(HasSubstr("score: "), HasSubstr("0 to 1"))) << score;
  }
  using Ellipse = std::array<double, 5>;
  for (const Ellipse& ellipse : {Ellipse{1, 2, 0, 4, 0}, Ellipse{1, 2, 3, -4, 0},
                                 Ellipse{1, 2, 3, 4, kNaN}, Ellipse{kNaN, 2, 3, 4, 0}}) {
    detection = Good();
    detection.ellipse = ellipse;
    EXPECT_THAT(ProblemOf(detection), HasSubstr("ellipse: ["));
  }
}

}  // namespace
}  // namespace oaslam
