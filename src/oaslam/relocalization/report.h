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

// Where a frame is in the map by its points, and what speaks for it.
struct RelocalizationReport {
  bool success = false;
  std::string why_not;
  Rigid3 cam_from_world;
  std::vector<LandmarkId> landmarks;  // per key point, inliers only; invalid elsewhere
  int inliers = 0;
  int expected = 0;           // landmarks that the pose puts into view
  double inlier_share = 0;    // of the landmarks that were found near their projection
  double chance_inliers = 0;  // that a wrong pose would have got by the same search
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  // as PoseReport's
  double sigma_position = 0;                                                     // map units
  KeyframeId keyframe;                     // the place that led to it; invalid for a verification
  std::vector<PoseHypothesis> hypotheses;  // by number of inliers, best first; also without success
};

}  // namespace oaslam
