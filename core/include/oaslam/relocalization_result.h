#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// How an image is looked for in a map.
struct RelocalizeOptions {
  RelocalizationMode mode = RelocalizationMode::kPointsAndObjects;
  // The camera's supposed pose, world_from_cam. Landmarks are searched around the prior first, but
  // a pose that is found there must pass the same acceptance test as any other.
  // RelocalizationMode::kObjects ignores it.
  std::optional<Rigid3> prior{};
  // The image's camera, if it is another one than that of the newest image of the Slam.
  std::optional<Camera> camera{};
  // The camera is not known, and found with the pose: those of the map are tried, and a focal
  // length estimated from the image's points. Needs an image. A MapLocalizer does this wherever no
  // camera is given.
  bool unknown_camera = false;
  // The boxes belong to a video: the boxes of the last second count, too. Time stamps must ascend
  // over these calls. Only for calls without an image, and not for a MapLocalizer, which keeps no
  // state between calls.
  bool follow = false;
};

// The result of finding one image in the map, independent of others:
//
//   const RelocalizationResult found = slam.Relocalize({.image = image});
//   if (found.world_from_cam)
//     Draw(*found.world_from_cam, found.confidence);
//   else
//     std::cerr << found.why_not << "\n";
struct RelocalizationResult {
  PoseEvidence evidence = PoseEvidence::kNone;  // the evidence for the pose; kNone: not found
  WorldId world;                                // of the map
  std::optional<Rigid3> world_from_cam;
  // In [0, 1]: the probability that the best hypothesis is right, accepted or not.
  double confidence = 0;
  // Statistic S and margin (docs/objects.md) of the best hypothesis from objects, where objects
  // were used.
  double object_score = 0, object_margin = 0;
  int inlier_points = 0, matched_objects = 0;
  // The covariance of the best hypothesis, accepted or not. It is relative to the part of the map
  // around the pose, and does not include the map's own error, which TrackingResult::covariance
  // does. `sigma_position` is SigmaOfPosition of this covariance; SigmaOfRotation gives the sigma
  // of the rotation.
  PoseCovariance covariance = PoseCovariance::Zero();
  double sigma_position = 0;
  // A hypothesis.
  struct Candidate {
    Rigid3 world_from_cam;
    // Higher is better. All candidates of one result have the same kind of evidence,
    // candidates_are_by: for points it is the number of points that agree (inlier_points of an
    // accepted pose), for objects the statistic S of docs/objects.md (object_score of an accepted
    // pose).
    double score = 0;
  };
  // The best hypotheses, best first. An accepted pose always comes first, although points may
  // confirm one that objects alone would not prefer.
  std::vector<Candidate> candidates;
  PoseEvidence candidates_are_by =
      PoseEvidence::kNone;       // kPoints or kObjects; kNone without candidates
  std::string why_not;           // empty where a pose was found; a sentence, may have commas
  std::optional<Camera> camera;  // the camera that was found, where it was unknown
  double focal_sigma_px = 0;     // of that camera; 0 where it is one of the map's
  // Time for extracting key points; and for the search that follows.
  double ms_features = 0, ms = 0;
};

}  // namespace oaslam
