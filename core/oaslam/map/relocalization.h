#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/features/features.h"
#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// A supposed pose of a camera.
struct PoseHypothesis {
  Rigid3 cam_from_world;
  double score = 0;  // higher is better; comparable within one image and one kind of evidence
  double depth = 0;  // of the object it came from, map units; 0: none, or not asked for
};

// The evidence of landmarks for a pose, and against it: landmarks that are expected and not found
// count, since identical windows in different walls agree in hundreds of points.
struct PointSupport {
  std::vector<LandmarkId> landmarks;  // by key point: inliers; invalid elsewhere
  int inliers = 0;
  int expected = 0;  // landmarks around the place that the image should show from this pose
  // Of the parts of the image in which landmarks are expected, the share in which some are found.
  double covered = 0;
  // The standard deviation of the position divided by the median distance of the landmarks, if all
  // landmarks were off by the same pixel: matches seen from an unusual side have correlated errors,
  // so that more of them in one corner of the image do not help.
  double relative_sigma = 0;
  // All landmarks that were found lie in one plane, and none of those expected beside the plane was
  // found.
  bool is_of_one_plane = false;
  // kLearned: compared by learned descriptors, too, which also match different things of one kind.
  Appearance appearance = Appearance::kOrb;
};

// The evidence of objects for a pose. `score` is the statistic S of docs/objects.md ("From
// ellipsoids to a pose"): log-likelihood ratio of the matched boxes * matched / detections of
// mapped classes, less a penalty for objects that should have been detected and were not.
struct ObjectSupport {
  std::vector<std::pair<int, ObjectId>> matched;  // index of the detection, object
  double score = 0;
  double margin = 0;  // score minus that of the best distinct pose
  double depth = 0;   // of the object the pose came from, map units
  // Sigma of the position by objects / mean distance to the matched objects; 1 without matched
  // objects.
  double relative_sigma = 1;
  // Score, margin and number of objects suffice for a pose by objects alone; its confidence must
  // suffice, too.
  bool suffices = false;

  // The margin counts more than the score: that every other pose explains the boxes much worse is
  // stronger evidence than that this one explains them well.
  double Evidence() const { return score / 2 + margin; }
};

// Where the camera of an image is in a map: the pose, what supports it, or why it is not known.
struct Relocalization {
  // kNone: no pose is accepted, and the pose and its fields are those of the best hypothesis.
  PoseEvidence evidence = PoseEvidence::kNone;
  std::string why_not;  // why a search found no pose; empty otherwise
  Rigid3 cam_from_world;
  // Of a small motion (translation in map units, rotation in rad) applied after the pose.
  PoseCovariance covariance = PoseCovariance::Zero();
  double confidence = 0;  // [0, 1], of the best hypothesis, accepted or not
  PointSupport points;
  ObjectSupport objects;
  // Of the search, best first; LeadWithAccepted puts an accepted pose in front.
  std::vector<PoseHypothesis> candidates;
  // kPoints or kObjects: the evidence that the scores of `candidates` measure.
  PoseEvidence candidates_are_by = PoseEvidence::kNone;
  // Where the camera was not known: a camera of the map, or one whose focal length was estimated
  // from the points. `focal_sigma`: relative standard deviation of that focal length; 0 for a
  // camera of the map.
  std::optional<Camera> camera;
  double focal_sigma = 0;

  bool IsFound() const { return evidence != PoseEvidence::kNone; }
  double sigma_position() const { return SigmaOfPosition(covariance); }  // map units
};

}  // namespace oaslam
