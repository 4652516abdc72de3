#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "oaslam/rigid3.h"
#include "oaslam/util/ids.h"

namespace oaslam {

struct PoseHypothesis {
  Rigid3 cam_from_world;
  double score = 0;  // higher is better; comparable within one image
};

// The pose of a frame found by points, and its evidence.
struct RelocalizationReport {
  bool success = false;
  std::string why_not;
  Rigid3 cam_from_world;
  std::vector<LandmarkId> landmarks;  // by key point: inliers; invalid elsewhere
  int inliers = 0;
  int expected = 0;           // landmarks expected in the image at this pose
  double inlier_share = 0;    // of the landmarks that were found near their projection
  double chance_inliers = 0;  // inliers that the same search would give for a wrong pose
  PoseCovariance covariance = PoseCovariance::Zero();  // as PoseReport's
  double sigma_position = 0;                           // map units
  KeyframeId keyframe;                     // the place that was matched; invalid for VerifyByPoints
  std::vector<PoseHypothesis> hypotheses;  // by number of inliers, best first; also without success
};

}  // namespace oaslam
