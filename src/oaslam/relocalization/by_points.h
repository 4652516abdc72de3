#pragma once

#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/relocalization/report.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Finds a frame in the map by its points alone: places of similar appearance, pose from their landmarks (P3P in RANSAC), then a guided
// search for the other landmarks around, which has to confirm it.
RelocalizationReport RelocalizeByPoints(const Frame& frame, const Map& map, const PlaceIndex& index,
                                        const RelocalizationConfig& config, const TrackingConfig& tracking, Rng& rng);

// Confirms and refines a pose that comes from elsewhere, such as objects: landmarks are searched around their projection, `search_radius_px`
// at first (how far the guess may be off in the image), then closer.
RelocalizationReport VerifyByPoints(const Frame& frame, const Map& map, const Rigid3& cam_from_world_guess, double search_radius_px,
                                    const RelocalizationConfig& config, const TrackingConfig& tracking, Rng& rng);

}  // namespace oaslam
