#pragma once

#include <vector>

#include "oaslam/config.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/object_scene.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A pose that was found in one image.
struct FoundPose {
  ObjectPoseCandidate candidate;
  double depth = 0;  // of the object it came from, map units: poses are compared relative to it
};

// Whether two poses are of distinct places, for margins and lists.
bool AreElsewhere(const FoundPose& a, const FoundPose& b);

// The evidence that suffices to report a pose.
struct ObjectDemands {
  double margin = 0, evidence = 0;  // ObjectPoseCandidate::Evidence
  int objects = 0;

  ObjectDemands(const ObjectScene& scene, const RelocalizationConfig& config);
  bool AreMetBy(const ObjectPoseCandidate& candidate, int matched_objects) const;
};

// The refined poses of an image, best score first; not distinct.
std::vector<FoundPose> SearchPoses(const ObjectScene& scene, const ObjectDemands& demands,
                                   Rng& rng);

}  // namespace oaslam
