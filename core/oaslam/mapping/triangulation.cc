#include "oaslam/estimation/triangulation.h"

#include <algorithm>
#include <map>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/mapping/local_mapping.h"
#include "oaslam/matching/descriptor_match.h"

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

// A learned descriptor still matches from a view that differs by so much.
constexpr double kMinCos = 0.94, kMaxScale = 1.5;  // 20 degrees

// Whether a described keyframe sees the landmark from about the same side as this camera.
bool IsDescribedFrom(const Map& map, const Landmark& landmark, const Eigen::Vector3d& camera) {
  const Eigen::Vector3d to_camera = camera - landmark.position;
  return std::ranges::any_of(landmark.observations, [&](const Observation& o) {
    const Keyframe& keyframe = map.keyframes.At(o.keyframe);
    if (!keyframe.features->learned.Find(o.keypoint)) return false;
    const Eigen::Vector3d to_other = keyframe.cam_from_world.OriginInSource() - landmark.position;
    const double lengths = to_camera.norm() * to_other.norm();
    const double scale = to_camera.norm() / to_other.norm();
    return to_camera.dot(to_other) > kMinCos * lengths && scale < kMaxScale &&
           scale > 1 / kMaxScale;
  });
}

}  // namespace

std::vector<LandmarkId> TriangulateNewLandmarks(KeyframeId id, Map& map) {
  constexpr double kMaxRayCos = 0.9998;  // 1.1 degrees; with less parallax depth is uncertain
  constexpr double kMinBaselineToDepth = 0.01;  // 0.6 degrees of parallax at the median depth
  std::vector<LandmarkId> created;
  for (const KeyframeId neighbour : TriangulationPartners(map, id, kFusedKeyframes)) {
    const Keyframe& here = map.keyframes.At(id);
    const Keyframe& there = map.keyframes.At(neighbour);
    const double baseline =
        (here.cam_from_world.OriginInSource() - there.cam_from_world.OriginInSource()).norm();
    // 0 where the neighbour has no landmark, as after a fast turn: then it shall get some.
    const double depth = map.MedianDepth(neighbour);
    if (baseline <= 0 || baseline < kMinBaselineToDepth * depth) continue;
    std::vector<std::pair<std::pair<int, int>, Eigen::Vector3d>> found;
    for (const auto& pair : MatchAlongEpipolarLines(map, here, there)) {
      const View a{map.cameras[here.camera], here, pair.first},
          b{map.cameras[there.camera], there, pair.second};
      if (const auto x = Triangulated(a, b, kMaxRayCos)) found.emplace_back(pair, *x);
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

PointsToDescribe FindPointsToDescribe(KeyframeId id, const Map& map) {
  constexpr int kPartners = 5;
  constexpr double kMaxRayCos = 0.9994;  // 2 degrees
  const Keyframe& here = map.keyframes.At(id);
  std::map<uint16_t, float> depth_of;  // by key point
  for (size_t k = 0; k < here.landmarks.size(); ++k)
    if (here.landmarks[k].IsValid() && !IsDescribedFrom(map, map.landmarks.At(here.landmarks[k]),
                                                        here.cam_from_world.OriginInSource()))
      depth_of[static_cast<uint16_t>(k)] = 0;
  for (const KeyframeId partner : TriangulationPartners(map, id, kPartners)) {
    const Keyframe& there = map.keyframes.At(partner);
    for (const auto& pair : MatchAlongEpipolarLines(map, here, there)) {
      const View a{map.cameras[here.camera], here, pair.first},
          b{map.cameras[there.camera], there, pair.second};
      if (const auto x = Triangulated(a, b, kMaxRayCos))
        depth_of.emplace(static_cast<uint16_t>(pair.first),
                         static_cast<float>((here.cam_from_world * *x).z()));
    }
  }
  PointsToDescribe points;
  for (const auto& [keypoint, depth] : depth_of) {
    points.keypoints.push_back(keypoint);
    points.depths.push_back(depth);
  }
  return points;
}

}  // namespace oaslam
