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

// Projects the landmarks that the camera could see from this pose.
std::vector<ProjectedLandmark> ProjectLandmarks(const Map& map,
                                                std::span<const LandmarkId> landmarks,
                                                const Frame& frame, const Rigid3& cam_from_world);

// Refines a pose that is correct to a few pixels: searches the landmarks around their
// projections with decreasing radius. Fills in the evidence of the report; success and
// why_not are set by Judge.
RelocalizationReport SearchAround(const Frame& frame, const Map& map,
                                  std::span<const LandmarkId> landmarks,
                                  const Rigid3& cam_from_world);

// Decides whether the evidence suffices. There must be `enough_inliers`, or `few_inliers` that are
// a good share of the matches; and many more than expected by chance. They must also determine the
// position to `max_relative_sigma` of their median distance even if all were off by the same pixel:
// matches seen from an unusual side have correlated errors, so that more of them in one corner of
// the image do not help.
void Judge(const Map& map, int enough_inliers, int few_inliers, RelocalizationReport& report,
           double max_relative_sigma = 0.03);

}  // namespace oaslam
