#pragma once

#include <optional>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Landmarks that must agree with a pose in the half second after a lost camera was found.
constexpr int kMinRelocalizationInliers = 50;
// The largest number of iterations of RANSAC with P3P on matched points.
constexpr int kRansacIterations = 300;

// Relocalizes a frame by its points: finds places of similar appearance, estimates the
// pose from their landmarks (P3P in RANSAC), and confirms it by a guided search for the
// other landmarks around. `appearance`: by which descriptors places are found. `roughly`: a pose
// (camera from world) that is known from elsewhere; of the places found, those that were seen
// from too different a direction to be matched are left out.
Relocalization RelocalizeByPoints(const Frame& frame, const Map& map, const PlaceIndex& index,
                                  const RelocalizationConfig& config, Rng& rng,
                                  Appearance appearance = Appearance::kOrb,
                                  const std::optional<Rigid3>& roughly = std::nullopt);

// Relocalizes a frame whose focal length is not known. Its camera must have no distortion; its
// focal length is ignored. Focal lengths over the whole range of lenses are tried, and the one with
// the most points is refined together with the pose.
Relocalization RelocalizeByPointsAndFocal(const Frame& frame, const Map& map,
                                          const PlaceIndex& index,
                                          const RelocalizationConfig& config, Rng& rng,
                                          Appearance appearance = Appearance::kOrb);

// Refines a relocalized pose together with the focal length of the frame's camera, and judges the
// pose anew. `focal_sigma` is infinite where the points do not determine the focal length.
Relocalization RefineFocal(const Frame& frame, const Map& map, Relocalization found,
                           double min_confidence);

}  // namespace oaslam
