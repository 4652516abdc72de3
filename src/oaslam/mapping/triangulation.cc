#include "oaslam/estimation/triangulation.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/mapping/local_mapping.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/matching/fusion.h"

namespace oaslam {
namespace {

struct View {
  const Camera& camera;
  const Keyframe& keyframe;
  int keypoint;

  const Keypoint& point() const { return keyframe.features->keypoints[keypoint]; }
  Eigen::Vector3d Ray() const { return RayOf(camera, point().px.cast<double>()); }
  double Sigma() const { return keyframe.features->pyramid.scale[point().octave]; }
  // Proportional to the angle that the key point's patch subtends.
  double Scale() const { return Sigma() / camera.fx; }
};

bool Reprojects(const View& view, const Eigen::Vector3d& x) {
  const Eigen::Vector3d x_in_cam = view.keyframe.cam_from_world * x;
  if (x_in_cam.z() <= 0) return false;
  const double sigma = view.Sigma();
  return (ProjectIdeal(view.camera, x_in_cam) - view.point().px.cast<double>()).squaredNorm() <=
         5.991 * sigma * sigma;
}

// Triangulates a point from two views; nothing where the parallax is too small, an error of
// reprojection too large, or the sizes of the key points do not fit the distances.
std::optional<Eigen::Vector3d> Triangulated(const View& a, const View& b, double max_ray_cos) {
  const auto x =
      TriangulateRays(a.keyframe.cam_from_world, b.keyframe.cam_from_world, a.Ray(), b.Ray());
  if (!x || x->cos_parallax <= 0 || x->cos_parallax >= max_ray_cos) return std::nullopt;
  if (!Reprojects(a, x->point) || !Reprojects(b, x->point)) return std::nullopt;
  const double distance_a = (x->point - a.keyframe.cam_from_world.OriginInSource()).norm();
  const double distance_b = (x->point - b.keyframe.cam_from_world.OriginInSource()).norm();
  const double distance_ratio = distance_b / distance_a, scale_ratio = b.Scale() / a.Scale();
  const double tolerance = 1.5 * a.keyframe.features->pyramid.factor;
  if (distance_ratio * tolerance < scale_ratio || distance_ratio > scale_ratio * tolerance)
    return std::nullopt;
  return x->point;
}

// The covisible keyframes, and the few just before this one: a camera that turns fast shares few
// landmarks with them, but much of the view.
std::vector<KeyframeId> TriangulationPartners(const Map& map, KeyframeId id, int count) {
  constexpr uint32_t kJustBefore = 3;  // at 0.1 s apart; a fast turn has left the view after more
  std::vector<KeyframeId> partners = map.CovisibleKeyframes(id, count);
  for (uint32_t back = 1; back <= std::min(kJustBefore, id.value); ++back) {
    const KeyframeId before(id.value - back);
    if (map.keyframes.Contains(before) && std::ranges::find(partners, before) == partners.end())
      partners.push_back(before);
  }
  return partners;
}

}  // namespace

std::vector<LandmarkId> TriangulateNewLandmarks(KeyframeId id, const MappingConfig& config,
                                                Map& map) {
  constexpr double kMinBaselineToDepth = 0.01;  // 0.6 degrees of parallax at the median depth
  std::vector<LandmarkId> created;
  for (const KeyframeId neighbour : TriangulationPartners(map, id, config.covisible_neighbors)) {
    const Keyframe& here = map.keyframes.At(id);
    const Keyframe& there = map.keyframes.At(neighbour);
    const double baseline =
        (here.cam_from_world.OriginInSource() - there.cam_from_world.OriginInSource()).norm();
    const double depth = map.MedianDepth(neighbour);
    if (depth <= 0 || baseline < kMinBaselineToDepth * depth) continue;
    std::vector<std::pair<std::pair<int, int>, Eigen::Vector3d>> found;
    for (const auto& pair : MatchAlongEpipolarLines(map, here, there)) {
      const View a{map.cameras[here.camera], here, pair.first},
          b{map.cameras[there.camera], there, pair.second};
      if (const auto x = Triangulated(a, b, config.min_parallax_cos)) found.emplace_back(pair, *x);
    }
    for (const auto& [pair, x] : found) {
      const LandmarkId landmark = map.AddLandmark(x, id);
      map.AddObservation(landmark, neighbour, pair.second);
      map.AddObservation(landmark, id, pair.first);
      map.UpdateLandmark(landmark);
      created.push_back(landmark);
    }
  }
  return created;
}

void FuseLandmarks(KeyframeId id, const MappingConfig& config, Map& map) {
  constexpr double kRadiusPx = 3;       // the pose is adjusted already
  constexpr int kSecondNeighbours = 5;  // of each neighbour; bounds the time
  std::vector<KeyframeId> targets = map.CovisibleKeyframes(id, config.covisible_neighbors);
  const size_t direct = targets.size();
  for (size_t i = 0; i < direct; ++i)
    for (const KeyframeId second : map.CovisibleKeyframes(targets[i], kSecondNeighbours))
      if (second != id && std::ranges::find(targets, second) == targets.end())
        targets.push_back(second);
  const auto landmarks_of = [&](KeyframeId keyframe) {
    return LandmarksSeenBy(map, std::span(&keyframe, 1));
  };
  for (const KeyframeId target : targets)
    ApplyFusion(FindFusionCandidates(map, target, landmarks_of(id), kRadiusPx), target, map);

  const std::vector<LandmarkId> theirs = LandmarksSeenBy(map, targets);
  ApplyFusion(FindFusionCandidates(map, id, theirs, kRadiusPx), id, map);
  for (const LandmarkId landmark : landmarks_of(id)) map.UpdateLandmark(landmark);
  map.UpdateCovisibility(id, config.min_shared_landmarks);
}

}  // namespace oaslam
