#pragma once

#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/object_scene.h"

namespace oaslam {

// Refines a pose on the edges of the boxes it explains, each weighted by the detector's and its object's uncertainty,
// and evaluates it (objects-study.md, sections 3b and 5.8). `margin` and `accepted` are left to the caller, who knows
// the other poses.
ObjectPoseCandidate RefineObjectPose(const ObjectScene& scene, const Rigid3& start);

}  // namespace oaslam
