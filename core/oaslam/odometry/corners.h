#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "oaslam/features/grey_image.h"

namespace oaslam {

struct CornerGrid {
  int cell = 32;     // px, the side of a cell
  int per_cell = 2;  // points that a cell shall have, tracked ones included
  int max_points = 400;
};

// New points to track, where the grid has too few among `tracked`: in each cell the places whose
// structure tensor has the largest smaller eigenvalue (Shi and Tomasi 1994), away from tracked
// points. The best points of each cell come first. A point may be weak: on a blank wall it is
// better than none.
std::vector<Eigen::Vector2f> FindCorners(const GreyImage& image,
                                         std::span<const Eigen::Vector2f> tracked,
                                         const CornerGrid& grid);

}  // namespace oaslam
