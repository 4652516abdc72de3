#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "oaslam/odometry/inverse_depth_kernels.h"
#include "oaslam/odometry/inverse_depth_problem.h"

namespace oaslam {

// The measurements of a problem in the order of the kernels: by pairs of images, of which there are
// far fewer.
class SightingsByPair {
 public:
  struct Images {
    int pose, anchor;
  };

  // `with_outliers`: measurements that are outliers count like the others. The problem is
  // kept by reference, as long as Update is called.
  void Set(const InverseDepthProblem& problem, size_t poses, bool with_outliers);
  void Update(const InverseDepthState& state);

  std::span<const ImagePair> pairs() const { return pairs_; }
  const Images& ImagesOf(size_t pair) const { return images_[pair]; }
  const SightingTable& table() const { return table_; }
  size_t rows() const { return table_.seen_x.size(); }
  size_t RowOf(size_t measurement) const { return row_of_[measurement]; }
  const ImagePair& PairOf(size_t measurement) const { return pairs_[pair_of_[measurement]]; }

 private:
  void FindPairs(size_t poses);

  const InverseDepthProblem* problem_ = nullptr;
  std::vector<ImagePair> pairs_;
  std::vector<Images> images_;  // of each pair
  SightingTable table_;
  std::vector<size_t> pair_of_, row_of_;  // of each measurement
};

}  // namespace oaslam
