#pragma once

namespace oaslam {

// The two key points whose descriptors are nearest to one descriptor.
struct TwoNearest {
  static constexpr int kNone = 256;  // no two descriptors of 256 bits are farther apart
  int best = kNone, next = kNone;    // Hamming distances
  int best_level = -1, next_level = -1;
  int keypoint = -1;  // the nearest

  void Add(int distance, int level, int candidate) {
    if (distance < best) {
      next = best;
      next_level = best_level;
      best = distance;
      best_level = level;
      keypoint = candidate;
    } else if (distance < next) {
      next = distance;
      next_level = level;
    }
  }
};

}  // namespace oaslam
