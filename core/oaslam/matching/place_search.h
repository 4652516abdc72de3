#pragma once

#include <optional>
#include <span>
#include <vector>

#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The least number of matches: a RANSAC on fewer finds a pose by chance.
constexpr int kMinMatches = 10;

struct PlaceSearchOptions {
  int ransac_iterations = 0;  // at most
  double min_confidence = 0;  // of a pose that is accepted
};

// Relocalizes a frame at one place: matches it with all points of the place (MatchPlace), estimates
// its pose (P3P in RANSAC), and confirms the pose by a guided search for the other landmarks
// around. Returns the best hypothesis, accepted or not; nothing where there is none.
std::optional<Relocalization> FindAtPlace(const Frame& frame, const Map& map, const Place& place,
                                          Appearance appearance, const PlaceSearchOptions& options,
                                          Rng& rng);

// Confirms and refines a pose from another source, such as objects. First searches `landmarks`
// (ascending) within `radius_px` of their projections, which is the error of the guess in the
// image. The landmarks found determine the place. Then searches more closely for those of
// `landmarks` that an image of that place may show.
Relocalization FindNear(const Frame& frame, const Map& map, std::span<const LandmarkId> landmarks,
                        const Rigid3& guess, double radius_px, const PlaceSearchOptions& options,
                        Rng& rng);

// All landmarks that an image of this place may show, ascending.
std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId place);

// The probability, in [0, 1], that the best hypothesis is right: within 0.5 m and 30 degrees of the
// truth on table tops seen from 1 to 3 m. It is a logistic curve; tools/acceptance fitted the one
// for ORB, and the one for learned descriptors is fitted to images looked for in maps of their own
// room and of other rooms (docs/lab/relocalization.md).
double ConfidenceOfPoints(const PointSupport& best);

// Refines a pose that is correct to a few pixels: searches the landmarks around their
// projections with decreasing radius. Fills in the support of the points and the confidence;
// evidence and why_not are set by Judge.
Relocalization SearchAround(const Frame& frame, const Map& map,
                            std::span<const LandmarkId> landmarks, const Rigid3& cam_from_world,
                            Appearance appearance);

// Computes the confidence, and the part of the support that depends on the pose's covariance.
// `tolerance`: the factor by which the position is expected to be less certain than with a known
// camera.
void Weigh(const Map& map, Relocalization& found, double tolerance = 1);

// Whether the landmarks that were found for a pose are flat (plane_support.h).
bool IsFlat(const Map& map, const Relocalization& found);

// Accepts a pose whose confidence is at least `min_confidence`.
void Judge(double min_confidence, Relocalization& found);

}  // namespace oaslam
