#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "oaslam/formats/trajectory_file.h"
#include "oaslam/geometry/similarity.h"

namespace oaslam {

// Poses farther apart in time than this are not of the same image.
constexpr double kMaxTimeDifference = 0.02;  // seconds

struct AssociatedPair {
  size_t reference = 0, query = 0;  // indices
};

// For each query the reference nearest in time, where it is near enough. Both ascending in time.
std::vector<AssociatedPair> Associate(const std::vector<StampedPose>& reference,
                                      const std::vector<StampedPose>& query,
                                      double max_difference = kMaxTimeDifference);

// One pose a time stamp, the last given.
std::vector<StampedPose> WithoutDuplicates(const std::vector<StampedPose>& poses);

// reference_from_query.
using Alignment = Similarity;

// Of a camera's pose: position and orientation in the reference frame.
inline Rigid3 operator*(const Alignment& alignment, const Rigid3& world_from_cam) {
  return {alignment.rotation * world_from_cam.rotation, alignment * world_from_cam.translation};
}

enum class AlignMode { kSim3, kSe3, kNone };

// Least squares over the positions of the pairs (Umeyama 1991). Nothing with fewer than three pairs
// or without motion.
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
