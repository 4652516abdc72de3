#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "oaslam/estimation/huber.h"

namespace oaslam {

// The measurements of each point, among measurements that are sorted by point.
template <typename Measurement>
class ByPoint {
 public:
  ByPoint(std::span<const Measurement> measurements, size_t points)
      : measurements_(measurements), first_(points + 1, 0) {
    for (const Measurement& s : measurements) ++first_[s.point + 1];
    for (size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  }
  size_t points() const { return first_.size() - 1; }
  int First(size_t point) const { return first_[point]; }
  int End(size_t point) const { return first_[point + 1]; }
  // Whether the point is behind a camera; `depth_of(measurement)`: in the camera that made it.
  template <typename DepthOf>
  bool IsBehind(size_t point, DepthOf&& depth_of) const {
    return std::any_of(measurements_.begin() + First(point), measurements_.begin() + End(point),
                       [&](const Measurement& s) { return depth_of(s) < kMinDepth; });
  }

 private:
  std::span<const Measurement> measurements_;
  std::vector<int> first_;
};

}  // namespace oaslam
