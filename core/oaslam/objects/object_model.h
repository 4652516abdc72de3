#pragma once

#include <optional>
#include <span>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Least overlap of the projection and a detection that counts as agreement, as in the paper.
constexpr double kMinAcceptIoU = 0.3;

struct ObjectModel {
  Ellipsoid ellipsoid;
  ViewOverlap overlap;
};

// The observations as views, at the present poses of their keyframes.
std::vector<BoxView> ViewsOf(const Map& map, std::span<const ObjectObservation> observations);

// Fits an ellipsoid: starts from `current` where that is given and the result is good, otherwise
// from a new sphere. Returns nothing when the observations do not determine one.
std::optional<ObjectModel> FitObjectModel(const Map& map, std::span<const BoxView> views,
                                          const Ellipsoid* current, const ObjectsConfig& config);

// Sets the ellipsoid of an object and the values that follow from it.
void AdoptModel(const ObjectModel& model, std::span<const BoxView> views, Object& object);

// Keeps at most kMaxObservations, spread over the track: repeatedly drops the one that is nearest
// to its neighbours in angle and time. Bounds the time of a fit; more boxes have correlated errors.
constexpr size_t kMaxObservations = 60;
void ThinObservations(const Map& map, std::vector<ObjectObservation>& observations);

}  // namespace oaslam
