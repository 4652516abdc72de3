#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/features/image_mask.h"
#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {

// Finds parts of the image that move with the camera: connected parts whose points stay where they
// are in the image while points elsewhere move as if the camera turned, in several directions and
// over seconds. Far points move in a turn, too, and a camera at rest sees nothing move in most of
// its image: neither makes such a part.
class StillParts {
 public:
  // Looks at an image, unless one was looked at just before. Times ascend. Returns whether the mask
  // has changed.
  bool Add(const GreyImage& image, double time_s);
  const ImageMask& mask() const { return mask_; }
  // Whether so many images showed no such part that none is to be expected.
  bool IsSettled() const { return is_settled_; }
  // Seconds of images without a part, after which none is to be expected.
  static constexpr double kEnough_s = 12;

 private:
  static constexpr int kColumns = 32;

  struct Cell {
    int still = 0, moved = 0;  // images in which the point there stayed, or moved as most did
  };
  struct Comparison;

  Comparison Compare(const GreyPyramid& present) const;
  bool Decide();
  std::vector<char> StillCells() const;
  size_t CellAt(const Eigen::Vector2f& px) const;

  std::optional<GreyPyramid> reference_, earlier_, next_earlier_;
  double next_earlier_s_ = 0;
  double reference_s_ = 0, compared_s_ = 0, first_s_ = 0, last_s_ = 0;
  int width_ = 0, height_ = 0, rows_ = 0;  // of the images that are compared; rows of cells
  std::vector<Cell> cells_;
  std::vector<Eigen::Vector2f> motions_;  // of the scene in the image, unit vectors
  int count_ = 0;                         // images in which the scene moved
  bool is_settled_ = false;
  ImageMask mask_;
};

// Where most of a mask is, as a message says it: "18 % of the image, at the bottom".
std::string Describe(const ImageMask& mask);

}  // namespace oaslam
