#pragma once

#include <span>
#include <vector>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"

namespace oaslam {

// Projects the landmarks that the camera could see from this pose.
std::vector<ProjectedLandmark> ProjectLandmarks(const Map& map,
                                                std::span<const LandmarkId> landmarks,
                                                const Frame& frame, const Rigid3& cam_from_world);

// Refines a pose that is correct to a few pixels: searches the landmarks around their
// projections with decreasing radius. Fills in the support of the points and the confidence;
// evidence and why_not are set by Judge.
Relocalization SearchAround(const Frame& frame, const Map& map,
                            std::span<const LandmarkId> landmarks, const Rigid3& cam_from_world);

// Fills in what of the support depends on the pose's covariance, and the confidence. `tolerance`:
// how many times less certain than for a known camera the position is expected to be.
void Weigh(const Map& map, Relocalization& found, double tolerance = 1);

// Accepts a pose that is right with this probability.
void Judge(double min_confidence, Relocalization& found);

}  // namespace oaslam
