#pragma once

#include <span>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The poses of the last minute before `now`, enough to know the usual speed of a camera.
std::span<const FramePose> NewestPoses(const std::vector<FramePose>& trajectory, double now);

// Whether the camera moves plausibly between two submaps under `world_from_other`. From a frame of
// one submap to a frame of the other shortly after, it may neither move nor turn much faster than
// within the submaps. This rejects similarities that fit at one end only, because a submap is bent
// or has a wrong scale.
bool IsContinuous(const Map& map, std::span<const FramePose> trajectory, const Map& other,
                  std::span<const FramePose> other_trajectory, const Similarity& world_from_other);

}  // namespace oaslam
