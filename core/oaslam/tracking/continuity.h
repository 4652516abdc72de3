#pragma once

#include <span>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"

namespace oaslam {

// The poses of the last minute before `now`, enough to know the usual speed of a camera.
std::span<const FramePose> NewestPoses(const std::vector<FramePose>& trajectory, double now);

// In seconds. Between two frames that are farther apart in time lies a pause or a change of
// recording: such frames say nothing about the speed of the camera.
inline constexpr double kLongestStep = 3;

// Whether the landmarks that support a pose distinguish its place from all others. The landmarks of
// one window or poster do not: a copy may hang in another room. They suffice where the camera was
// seen in the map at most kLongestStep before, since IsContinuous then rejects other rooms, and
// where both maps are of one wall or table. `from`: the map of the image that was found in `map`;
// `map` itself where the camera is lost in it. `seconds_since_seen`: since the camera was last seen
// in `map`; infinite where this is not known, or where the camera may have jumped.
bool TellsPlace(const Map& map, const Map& from, const Relocalization& found,
                double seconds_since_seen);

// Whether the camera moves plausibly between two submaps under `world_from_other`. From a frame of
// one submap to a frame of the other shortly after, it may neither move nor turn much faster than
// within the submaps. This rejects similarities that fit at one end only, because a submap is bent
// or has a wrong scale.
bool IsContinuous(const Map& map, std::span<const FramePose> trajectory, const Map& other,
                  std::span<const FramePose> other_trajectory, const Similarity& world_from_other);

}  // namespace oaslam
