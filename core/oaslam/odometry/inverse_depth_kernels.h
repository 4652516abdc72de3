#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace oaslam {

// The inner loops of the solver of a window (odometry/inverse_depth_solver), compiled for each
// instruction set and chosen at run time (Highway). All of them take four doubles at a time and add
// up in the same order, so that all give the same bits.
inline constexpr size_t kTogether = 4;

// `count`, rounded up to a multiple of kTogether.
inline size_t WholeVectors(size_t count) { return (count + kTogether - 1) / kTogether * kTogether; }

// The sightings of one image of the points of one anchor: rows of a SightingTable.
struct ImagePair {
  std::array<double, 9> rotation{};  // image_from_anchor, by columns
  std::array<double, 3> translation{};
  size_t begin = 0, end = 0;  // whole vectors
};

// Sightings, sorted by pairs of images, and within a pair by point. A row that pads the rows of a
// pair has no information and does not count.
struct SightingTable {
  std::vector<double> anchor_x, anchor_y;         // ray of the point in its anchor, z = 1
  std::vector<double> seen_x, seen_y;             // in the image
  std::vector<double> root_xx, root_xy, root_yy;  // of the information, symmetric; 1 / rad
  std::vector<double> inverse_depth;              // of the point

  void Resize(size_t rows);  // all zero
};

// The cost of each row by the pseudo-Huber loss (Hartley and Zisserman 2004, A6.8), a smooth
// version of the absolute residual. Near the squared residual `corner_chi2` the loss changes from a
// parabola to a line; 0: no robust loss.
void CostsOfSightings(std::span<const ImagePair> pairs, const SightingTable& table,
                      double corner_chi2, double* costs);

// The terms of a sighting in the normal equations in which its point takes part.
struct SightingTerms {
  double hessian, gradient;  // of the inverse depth
  // The cross terms of the inverse depth with a step of the image's pose, and of the anchor's.
  std::array<double, 6> by_image, by_anchor;
  std::array<double, 2> unused;
};
static_assert(sizeof(SightingTerms) == 16 * sizeof(double));  // which the kernel writes in a row

// The normal equations of a step of the pose of the image, summed over the sightings of a pair.
struct PairTerms {
  std::array<double, 36> hessian;
  std::array<double, 6> gradient;
};

// `terms` has as many elements as the table has rows, `sums` as many as there are pairs.
void LinearizeSightings(std::span<const ImagePair> pairs, const SightingTable& table,
                        double corner_chi2, SightingTerms* terms, PairTerms* sums);

// The block of a pose and an inverse depth in the normal equations.
struct DepthCross {
  std::array<double, 6> block;
  int pose;
};

// Blocks of 6 x 6 of the lower half of a symmetric matrix, each by columns.
class PoseBlocks {
 public:
  // All zero.
  void Resize(int poses) { blocks_.assign(36 * static_cast<size_t>(poses * (poses + 1) / 2), 0); }
  // row >= column
  double* At(int row, int column) { return blocks_.data() + 36 * (row * (row + 1) / 2 + column); }

 private:
  std::vector<double> blocks_;
};

// Eliminates the inverse depth of a point from the normal equations (Schur complement): subtracts
// its terms from the equations of the poses. `inverse`: the inverse of the information on the
// inverse depth.
void EliminateDepth(std::span<const DepthCross> cross, double inverse, PoseBlocks& system);

// Adds the robust cost of one sighting at each of the inverse depths to `costs`. The number of
// inverse depths is a multiple of kTogether.
void AddCostsOfDepths(const ImagePair& pair, const SightingTable& table, size_t row,
                      std::span<const double> inverse_depths, double corner_chi2, double* costs);

}  // namespace oaslam
