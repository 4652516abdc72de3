#pragma once

#include <span>
#include <vector>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/matching/projection_search.h"
#include "oaslam/relocalization/report.h"

namespace oaslam {

// All that the camera could see of these landmarks from this pose.
std::vector<ProjectedLandmark> ProjectLandmarks(const Map& map,
                                                std::span<const LandmarkId> landmarks,
                                                const Frame& frame, const Rigid3& cam_from_world);

// Refines a pose that is right to a few pixels by searching the landmarks around their projection,
// in narrowing rounds. The report's evidence is filled in; success and why_not are left to Judge.
RelocalizationReport SearchAround(const Frame& frame, const Map& map,
                                  std::span<const LandmarkId> landmarks,
                                  const Rigid3& cam_from_world);

// Decides whether the evidence suffices: `enough_inliers`, or at least `few_inliers` that are most
// of what was found, many more than chance would give, and determine the pose well: its position to
// `max_relative_sigma` of the points' median distance, if all were off by one pixel together: seen
// from an unusual side, matches err alike, and more of them in the same corner of the image do not
// help.
void Judge(const Map& map, int enough_inliers, int few_inliers, RelocalizationReport& report,
           double max_relative_sigma = 0.03);

}  // namespace oaslam
