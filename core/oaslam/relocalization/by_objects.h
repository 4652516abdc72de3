#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/rigid3.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Estimates the pose of a camera in the map from its detected objects alone. Returns up to five
// distinct poses, best first, of which only the first can be accepted; none where there are no
// hypotheses. `gravity_in_cam`: direction of gravity in the camera's frame (any length) where a
// sensor gives it; used if the map knows its vertical. `rng` draws triplets of objects where there
// are too many to try all.
std::vector<Relocalization> RelocalizeByObjects(
    std::span<const ObjectDetection> detections, const Camera& camera, const Map& map,
    const RelocalizationConfig& config, const std::optional<Eigen::Vector3d>& gravity_in_cam,
    Rng& rng);

// Refines a pose by points together with the detected objects. `by_points` must be found. Points of
// a view from an unusual side have correlated errors, so that all of them together count as one
// point: their covariance is multiplied by their number.
Relocalization RefineByPointsAndObjects(std::span<const ObjectDetection> detections,
                                        const Camera& camera, const Map& map,
                                        const RelocalizationConfig& config,
                                        const Relocalization& by_points);

}  // namespace oaslam
