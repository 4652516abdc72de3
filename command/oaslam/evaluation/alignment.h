#pragma once

#include <optional>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// Poses whose time stamps differ by more belong to different images: more than half an interval at
// 30 Hz.
constexpr double kMaxTimeDifference = 0.02;  // seconds

struct AssociatedPair {
  size_t reference = 0, query = 0;  // indices
};

// The pose nearest in time, the later one of two; null where none is near enough. `poses` must
// ascend in time.
const StampedPose* NearestInTime(const std::vector<StampedPose>& poses, double timestamp,
                                 double max_difference = kMaxTimeDifference);

// Assigns to each query the reference nearest in time, if it is near enough.
// Both must ascend in time.
std::vector<AssociatedPair> Associate(const std::vector<StampedPose>& reference,
                                      const std::vector<StampedPose>& query,
                                      double max_difference = kMaxTimeDifference);

// Keeps one pose for each time stamp, the last one given.
std::vector<StampedPose> WithoutDuplicates(const std::vector<StampedPose>& poses);

// reference_from_query.
using Alignment = Similarity;

// Transforms a camera's pose into the reference frame.
inline Rigid3 operator*(const Alignment& alignment, const Rigid3& world_from_cam) {
  return {alignment.rotation * world_from_cam.rotation, alignment * world_from_cam.translation};
}

std::vector<StampedPose> Aligned(std::vector<StampedPose> poses,
                                 const Alignment& reference_from_query);

enum class AlignMode { kSim3, kSe3, kNone };

// Aligns the positions of the pairs by least squares (Umeyama 1991). Returns nothing for fewer than
// three pairs or without motion.
std::optional<Alignment> AlignPositions(const std::vector<StampedPose>& reference,
                                        const std::vector<StampedPose>& query,
                                        const std::vector<AssociatedPair>& pairs, AlignMode mode);

struct PoseError {
  double timestamp = 0;  // of the query
  double position = 0;   // units of the reference
  double rotation_deg = 0;
};

PoseError ErrorOf(const StampedPose& reference, const StampedPose& query,
                  const Alignment& reference_from_query);

}  // namespace oaslam
