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

// The pose of a frame found by points, and its evidence. What should be there and is not counts
// against it: windows of one look on other walls agree in hundreds of points.
struct RelocalizationReport {
  bool success = false;
  std::string why_not;
  Rigid3 cam_from_world;
  std::vector<LandmarkId> landmarks;  // by key point: inliers; invalid elsewhere
  int inliers = 0;
  int expected = 0;  // landmarks around the place that the image should show from this pose
  // Of the parts of the image in which landmarks are expected, the share in which some are found.
  double covered = 0;
  // The sigma of the position over the median distance of the landmarks, if all were off by the
  // same pixel: matches seen from an unusual side have correlated errors, so that more of them in
  // one corner of the image do not help.
  double relative_sigma = 0;
  double confidence = 0;                               // ConfidenceOfPoints of this evidence
  PoseCovariance covariance = PoseCovariance::Zero();  // as PoseReport's
  double sigma_position = 0;                           // map units
  KeyframeId keyframe;                     // the place that was matched; invalid for VerifyByPoints
  std::vector<PoseHypothesis> hypotheses;  // by number of inliers, best first; also without success
};

}  // namespace oaslam
