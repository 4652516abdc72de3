#pragma once

#include <optional>
#include <span>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/map/map.h"

namespace oaslam {

// Best Hamming distances at which two descriptors are taken for the same point.
constexpr int kLooseHamming = 100;
constexpr int kTightHamming = 50;

// Where a camera should see a landmark.
struct ProjectedLandmark {
  LandmarkId id;
  Eigen::Vector2d px = Eigen::Vector2d::Zero();  // ideal image
  int level = 0;                                 // of the pyramid, from its distance
  double view_cos = 1;  // between the viewing direction and the landmark's mean one
};

// Nothing when behind the camera, outside of `bounds`, out of the landmark's range of distance, or
// seen from more than 60 degrees off its mean direction.
std::optional<ProjectedLandmark> ProjectLandmark(LandmarkId id, const Landmark& landmark,
                                                 const Camera& camera, const Rigid3& cam_from_world,
                                                 const Features& features);

// Matches of key points to landmarks of one image: `landmarks[keypoint]`, invalid where none.
struct LandmarkMatches {
  std::vector<LandmarkId> landmarks;
  int count = 0;
};

struct ProjectionSearchOptions {
  double radius_px = 4;  // at level 0; scaled by the level
  int max_hamming = kLooseHamming;
  double ratio = 0.8;          // best / second best, where both are on one level; 1 switches it off
  bool radius_by_view = true;  // 2.5 / 4 of the radius where seen nearly from the mean direction
};

// Finds each landmark near its projection: free key points (invalid in `taken`) only, each landmark
// once; of landmarks that compete for a key point the one with the closest descriptor wins. The
// result contains `taken`.
LandmarkMatches SearchByProjection(const Features& features, const Map& map,
                                   std::span<const ProjectedLandmark> projected,
                                   std::vector<LandmarkId> taken,
                                   const ProjectionSearchOptions& options);

// Follows the landmarks of the frame before into this one, from a predicted pose: search within
// `radius_px` (scaled by the level of the key point before) around the projection, levels differing
// by one at most, orientations turning together.
LandmarkMatches SearchFromLastFrame(const Features& features, const Camera& camera,
                                    const Rigid3& cam_from_world, const Map& map,
                                    const Features& last_features,
                                    std::span<const LandmarkId> last_landmarks, double radius_px);

}  // namespace oaslam
