#pragma once

#include <string_view>

namespace oaslam {

// The range in metres that holds nine of ten things of a class.
struct UsualRange {
  double least = 0, most = 0;

  double Median() const;    // of a log-normal distribution
  double LogSigma() const;  // the standard deviation of its logarithm
};

// The shape of a thing, around which a detector draws its box.
enum class Solid {
  kBox,       // with corners
  kCylinder,  // upright; of an elliptic outline where length and depth differ
  kBall,      // an ellipsoid
};

// How large the things of a class usually are.
struct UsualSize {
  std::string_view name;             // of the class
  UsualRange length, depth, height;  // length: the longer side on the ground
  Solid solid = Solid::kBox;
  // People put the thing down in any orientation: length, depth and height are only the longest,
  // the middle and the shortest side.
  bool lies_anyhow = false;
};

// The usual size of a class of COCO, or of another detector's class that is the same thing; null
// where things of the class are of any size.
const UsualSize* FindUsualSize(std::string_view class_name);

}  // namespace oaslam
