#pragma once

#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/matching/point_observation.h"

namespace oaslam {

// What the depths of a frame say of its pose in a map whose metre is known (SigmaOfMetre); nothing
// in any other map.

// Gives matched points the depths that were measured at their key points.
void MeasureDepths(const Frame& frame, const Map& map, MatchedPoints& matched);

// Of the landmarks that lie in the image at a pose, whether or not they are recognized: how many
// are where the depth camera measured a surface, and how many are before it, so that the camera
// sees through them. Landmarks behind a surface are hidden, and say nothing.
struct DepthAgreement {
  int agree = 0, seen_through = 0;

  bool Contradicts() const;
};
// `sigma_position`: of the pose, map units.
DepthAgreement CompareDepths(const Frame& frame, const Map& map, const Rigid3& cam_from_world,
                             double sigma_position);

// Refuses a pose that the depths contradict; returns whether they do.
bool RefuseByDepths(const Frame& frame, const Map& map, Relocalization& found);

}  // namespace oaslam
