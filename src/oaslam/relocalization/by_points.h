#pragma once

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/relocalization/report.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Finds a frame in the map by its points alone: places of similar appearance, pose from their
// landmarks (P3P in RANSAC), then a guided search for the other landmarks around, which has to
// confirm it.
RelocalizationReport RelocalizeByPoints(const Frame& frame, const Map& map, const PlaceIndex& index,
                                        const RelocalizationConfig& config,
                                        const TrackingConfig& tracking, Rng& rng);

struct FocalRelocalization {
  RelocalizationReport report;
  Camera camera;              // with the focal length that was found
  double relative_sigma = 0;  // of it
};

// The same for an image whose focal length is not known: that of its camera in the map, which has
// no distortion, does not matter. Places are tried with focal lengths over the whole range of
// lenses, and that with the most points is refined along with the pose.
FocalRelocalization RelocalizeByPointsAndFocal(const Frame& frame, const Map& map,
                                               const PlaceIndex& index,
                                               const RelocalizationConfig& config,
                                               const TrackingConfig& tracking, Rng& rng);

// A pose that was found, with its focal length as far as the points tell it: `frame` as before.
FocalRelocalization RefineFocal(const Frame& frame, const Map& map,
                                const RelocalizationReport& found, const TrackingConfig& tracking);

// Confirms and refines a pose that comes from elsewhere, such as objects: landmarks are searched
// around their projection, `search_radius_px` at first (how far the guess may be off in the image),
// then closer.
RelocalizationReport VerifyByPoints(const Frame& frame, const Map& map,
                                    const Rigid3& cam_from_world_guess, double search_radius_px,
                                    const RelocalizationConfig& config,
                                    const TrackingConfig& tracking, Rng& rng);

}  // namespace oaslam
