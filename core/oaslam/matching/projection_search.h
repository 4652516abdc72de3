#pragma once

#include <optional>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Largest Hamming distances at which two descriptors may show the same point; those of unrelated
// points differ by 128 on average. Loose: where a pose tells where to look; tight: where many key
// points are candidates.
constexpr int kLooseHamming = 100;
constexpr int kTightHamming = 50;

// The expected image of a landmark in a camera.
struct ProjectedLandmark {
  LandmarkId id;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // ideal image
  int level = 0;                                 // of the pyramid, predicted from the distance
  // Cosine between the viewing direction and the landmark's mean viewing direction.
  double view_cos = 1;
};

// Returns nothing when the landmark is behind the camera, outside of `bounds`, out of its range of
// distance, or seen from more than 60 degrees off its mean viewing direction.
std::optional<ProjectedLandmark> ProjectLandmark(LandmarkId id, const Landmark& landmark,
                                                 const Camera& camera, const Rigid3& cam_from_world,
                                                 const Features& features);

// The landmark of each key point of one image, invalid where there is none.
struct LandmarkMatches {
  std::vector<LandmarkId> landmarks;
  int count = 0;
  // By key point: Hamming distance of a match that SearchByProjection added.
  std::vector<int> distances{};
};

struct ProjectionSearchOptions {
  double radius_px = 4;  // at level 0; scaled by the level
  int max_hamming = kLooseHamming;
  // Best / second-best distance, tested where both are on one level; 1 switches it off.
  double ratio = 0.8;
  // Reduce the radius to 2.5 / 4 where the landmark is seen from nearly its mean direction.
  bool radius_by_view = true;
  // Compare learned descriptors, too, where both sides have one: the smaller distance counts.
  bool by_learned = false;
};

// Searches each landmark near its projection among the key points that are free (invalid in
// `taken`); where landmarks compete for a key point, the closest descriptor wins. The result
// contains `taken`.
LandmarkMatches SearchByProjection(const Features& features, const Map& map,
                                   std::span<const ProjectedLandmark> projected,
                                   std::vector<LandmarkId> taken,
                                   const ProjectionSearchOptions& options);

// Finds the landmarks of the previous frame in this one, given a predicted pose: within `radius_px`
// of their projections (scaled by the level of the previous key point), with levels that differ by
// at most one and consistent changes of orientation.
LandmarkMatches SearchFromLastFrame(const Features& features, const Camera& camera,
                                    const Rigid3& cam_from_world, const Map& map,
                                    const Features& last_features,
                                    std::span<const LandmarkId> last_landmarks, double radius_px);

}  // namespace oaslam
