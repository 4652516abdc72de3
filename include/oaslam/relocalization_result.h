#pragma once

#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// The result of finding one image in the map, independent of others.
struct RelocalizationResult {
  PoseEvidence evidence = PoseEvidence::kNone;  // the evidence for the pose; kNone: not found
  std::optional<Rigid3> world_from_cam;
  // In [0, 1]: how often the best hypothesis is right given this evidence, accepted or not.
  double confidence = 0;
  // Of the best hypothesis from objects, where objects were used.
  double object_score = 0, object_margin = 0;
  int inlier_points = 0, matched_objects = 0;
  double sigma_position = 0;  // map units, 1 sigma
  // A pose that was considered.
  struct Candidate {
    Rigid3 world_from_cam;
    // Higher is better. All candidates of one result are of one kind, which candidates_are_by
    // tells: by points it is the number of points that agree (for an accepted pose inlier_points),
    // by objects the statistic S of docs/objects.md (for an accepted pose object_score).
    double score = 0;
  };
  // The best hypotheses, best first; but an accepted pose is always the first, also where points
  // confirmed one that the objects alone did not prefer.
  std::vector<Candidate> candidates;
  PoseEvidence candidates_are_by = PoseEvidence::kNone;  // kPoints or kObjects, where there are any
  std::string why_not;                                   // where no pose was found
  std::optional<Camera> camera;  // the camera that was found, where it was unknown
  double focal_sigma_px = 0;     // of that camera; 0 where it is one of the map's
  double ms_features = 0, ms = 0;
};

}  // namespace oaslam
