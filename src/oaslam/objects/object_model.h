#pragma once

#include <optional>
#include <span>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"

namespace oaslam {

struct ObjectModel {
  Ellipsoid ellipsoid;
  ViewOverlap overlap;
};

// The observations as views, with the poses that their keyframes have now.
std::vector<BoxView> ViewsOf(const Map& map, std::span<const ObjectObservation> observations);

// The best ellipsoid: from `current` where given and good, otherwise from a new sphere. Nothing
// when the observations do not allow one.
std::optional<ObjectModel> FitObjectModel(const Map& map, std::span<const BoxView> views,
                                          const Ellipsoid* current, const ObjectsConfig& config);

// Keeps at most kMaxObservations, spread over the track: goes the one that is nearest to its
// neighbours in angle and time.
constexpr size_t kMaxObservations = 60;
void ThinObservations(const Map& map, std::vector<ObjectObservation>& observations);

}  // namespace oaslam
