#include "oaslam/anchors/placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "oaslam/estimation/plane_fit.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/util/median.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

// Against gravity, or as the cameras were held.
Eigen::Vector3d UpOf(const Map& map) {
  if (map.up) return map.up->normalized();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& k) {
    sum -= k.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitY();
  });
  return sum.norm() > 0 ? sum.normalized() : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
}

// y along `up`, z as far as can be towards the viewer.
Eigen::Quaterniond StandUp(const Eigen::Vector3d& up, const Eigen::Vector3d& to_viewer) {
  constexpr double kMinLevel = 1e-3;  // seen from directly above, any direction can be the front
  Eigen::Vector3d front = to_viewer - to_viewer.dot(up) * up;
  if (front.norm() < kMinLevel * to_viewer.norm() || !(to_viewer.norm() > 0))
    front = up.unitOrthogonal();
  front.normalize();
  Eigen::Matrix3d axes;
  axes << up.cross(front), up, front;
  return Eigen::Quaterniond(axes).normalized();
}

std::optional<Anchor> CarriedBy(const Map& map, KeyframeId keyframe,
                                const Rigid3& world_from_anchor) {
  const std::optional<Rigid3> cam_from_world = map.ResolvePose(keyframe);
  if (!cam_from_world) return std::nullopt;
  Anchor anchor;
  anchor.keyframe = keyframe;
  anchor.cam_from_anchor = *cam_from_world * world_from_anchor;
  return anchor;
}

Placement OnObject(const Map& map, ObjectId id, const AnchorRequest& request) {
  const std::optional<ObjectId> now = map.ResolveObject(id);
  const Object* object = now ? map.objects.Find(*now) : nullptr;
  if (!object || object->state != ObjectState::kMapped || object->observations.empty())
    return {std::nullopt, fmt::format("the map has no object {}", id.value)};
  const Ellipsoid& e = object->ellipsoid;
  const Eigen::Vector3d up = UpOf(map);
  const Eigen::Vector3d in_axes = (e.rotation.conjugate() * up).cwiseQuotient(e.half_axes);
  const Eigen::Vector3d top = up / in_axes.norm();  // from the center
  const KeyframeId seen_from = object->observations.back().reference;
  const bool has_ray = request.direction != Eigen::Vector3d::Zero();
  const std::optional<Rigid3> viewer = has_ray ? std::nullopt : map.ResolvePose(seen_from);
  const Eigen::Vector3d to_viewer = (viewer ? viewer->OriginInSource() : request.origin) - e.center;
  const Rigid3 world_from_anchor(StandUp(up, to_viewer), e.center + top);
  std::optional<Anchor> anchor = CarriedBy(map, seen_from, world_from_anchor);
  if (!anchor) return {std::nullopt, fmt::format("object {} has no keyframe", id.value)};
  anchor->object = *now;
  anchor->offset = map.ResolvePose(anchor->keyframe)->rotation * top;
  anchor->size = 2 * std::cbrt(e.half_axes.prod());
  return {anchor, ""};
}

// The keyframe that sees most of the landmarks; the first of several.
KeyframeId SeesMost(const Map& map, const std::vector<LandmarkId>& landmarks) {
  std::map<KeyframeId, int> counts;
  for (const LandmarkId id : landmarks)
    for (const Observation& o : map.landmarks.At(id).observations) ++counts[o.keyframe];
  const auto most =
      std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; });
  return most == counts.end() ? KeyframeId() : most->first;
}

// Landmarks around a ray, without those of mapped objects: content goes on the surface on which
// objects stand, or behind them.
struct Surroundings {
  std::vector<LandmarkId> ids;
  std::vector<Eigen::Vector3d> points;
};

Surroundings LandmarksAbout(const Map& map, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction, double half_angle_rad) {
  // Objects are enlarged by this factor, since landmarks on their corners are outside of the
  // ellipsoid that fits the box.
  constexpr double kMargin = 1.25;
  std::vector<Ellipsoid> objects;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    objects.push_back(object.ellipsoid);
    objects.back().half_axes *= kMargin;
  });
  Surroundings found;
  const double min_cosine = std::cos(half_angle_rad);
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    const Eigen::Vector3d x = landmark.position - origin;
    if (x.dot(direction) < min_cosine * x.norm() || !(x.norm() > 0)) return;
    if (std::ranges::any_of(objects,
                            [&](const Ellipsoid& e) { return Contains(e, landmark.position); }))
      return;
    found.ids.push_back(id);
    found.points.push_back(landmark.position);
  });
  return found;
}

// Fits a level plane to most of the points, at their median height: most surfaces that things stand
// on are level.
PlaneFit FitLevel(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& up,
                  const Eigen::Vector3d& viewpoint, double tolerance) {
  // Heights to try, each that of a point; bounds the time, which is quadratic in the points.
  constexpr size_t kMaxTried = 200;
  std::vector<double> all, reach;
  for (const Eigen::Vector3d& x : points) {
    all.push_back(up.dot(x));
    reach.push_back(tolerance * (x - viewpoint).norm());
  }
  PlaneFit best;
  for (size_t k = 0; k < points.size(); k += 1 + points.size() / kMaxTried) {
    std::vector<int> inliers;
    for (size_t i = 0; i < points.size(); ++i)
      if (std::abs(all[i] - all[k]) <= reach[i]) inliers.push_back(static_cast<int>(i));
    if (inliers.size() > best.inliers.size()) best.inliers = std::move(inliers);
  }
  if (best.inliers.empty()) return best;
  std::vector<double> heights;
  for (const int i : best.inliers) heights.push_back(all[i]);
  best.plane = {up, -Median(std::move(heights))};
  return best;
}

std::optional<PlaneFit> FitSurface(const std::vector<Eigen::Vector3d>& points,
                                   const std::optional<Eigen::Vector3d>& up,
                                   const Eigen::Vector3d& viewpoint) {
  constexpr double kTolerance = 0.006;  // of the distance, with which the noise of landmarks grows
  // Three points define a plane, one a level plane: the others confirm it.
  constexpr size_t kMinInliers = 8, kMinLevelInliers = 6;
  // A level plane is preferred if it has at least this share of the inliers of any plane, which
  // finds more of them with its two additional parameters.
  constexpr double kLevelShare = 0.5;
  Rng rng(0);
  std::optional<PlaneFit> any = FitPlane(points, viewpoint, kTolerance, rng);
  if (up) {
    PlaneFit level = FitLevel(points, up->normalized(), viewpoint, kTolerance);
    const double others = any ? static_cast<double>(any->inliers.size()) : 0;
    if (level.inliers.size() >= kMinLevelInliers &&
        static_cast<double>(level.inliers.size()) >= kLevelShare * others)
      return level;
  }
  return any && any->inliers.size() >= kMinInliers ? any : std::nullopt;
}

std::optional<MapSurface> FindSurface(const Map& map, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction, double half_angle_rad) {
  const auto [ids, points] = LandmarksAbout(map, origin, direction, half_angle_rad);
  const std::optional<PlaneFit> fit = FitSurface(points, map.up, origin);
  if (!fit) return std::nullopt;
  const double distance = -fit->plane.signedDistance(origin) / fit->plane.normal().dot(direction);
  // The ray must meet the plane among the points, not far before or behind them.
  const auto away = [&points = points, &origin](int i) { return (points[i] - origin).norm(); };
  const auto [near, far] = std::ranges::minmax(fit->inliers, {}, away);
  constexpr double kSlack = 1.3;  // of the nearest and the farthest point's distance
  if (!(distance * kSlack > away(near) && distance < kSlack * away(far))) return std::nullopt;
  std::vector<LandmarkId> seen;
  for (const int i : fit->inliers) seen.push_back(ids[i]);
  return MapSurface{origin + distance * direction, fit->plane.normal(), SeesMost(map, seen)};
}

Placement OnPoints(const Map& map, const AnchorRequest& request) {
  const auto surface = SurfaceAlong(map, request.origin, request.direction.normalized());
  if (!surface) return {std::nullopt, "too few landmarks there that lie in a plane"};
  const Eigen::Vector3d to_viewer = request.origin - surface->point;
  const Rigid3 world_from_anchor(StandUp(surface->normal, to_viewer), surface->point);
  std::optional<Anchor> anchor = CarriedBy(map, surface->keyframe, world_from_anchor);
  constexpr double kSize = 0.12;  // of the distance: 7 degrees of the view
  anchor->size = kSize * to_viewer.norm();
  return {anchor, ""};
}

}  // namespace

std::optional<MapSurface> SurfaceAlong(const Map& map, const Eigen::Vector3d& origin,
                                       const Eigen::Vector3d& direction) {
  for (const double half_angle_deg : {2., 4., 8., 16.}) {
    const auto surface = FindSurface(map, origin, direction, half_angle_deg * kDegree);
    if (surface && map.ResolvePose(surface->keyframe)) return surface;
  }
  return std::nullopt;
}

const char* const kNoPose =
    "the pose is not finite, its rotation is no unit quaternion, or the map has no keyframes";

std::string ProblemOfSize(double size) {
  // Wide bounds: the unit of a map may be small or large, and it can be scaled later.
  constexpr double kMin = 1e-6, kMax = 1e6;
  return size >= kMin && size <= kMax
             ? ""
             : fmt::format("size {}, must be from {} to {}", size, kMin, kMax);
}

std::optional<Anchor> AnchorAt(const Map& map, const Rigid3& pose) {
  if (!pose.IsValid()) return std::nullopt;
  return CarriedBy(map, map.NearestKeyframe(pose.translation), pose);
}

Placement FindPlace(const Map& map, const AnchorRequest& request) {
  if (request.size != 0)
    if (const std::string problem = ProblemOfSize(request.size); !problem.empty())
      return {std::nullopt, problem};
  if (request.pose) {
    Placement placement{AnchorAt(map, *request.pose), ""};
    if (!placement.anchor) return {std::nullopt, kNoPose};
    placement.anchor->model = request.model;
    placement.anchor->size = request.size > 0 ? request.size : 1;
    return placement;
  }
  if (map.keyframes.empty()) return {std::nullopt, "there is no map yet"};
  const double length = request.direction.norm();
  if (!request.origin.allFinite() || !std::isfinite(length) || !(length > 0 || request.object))
    return {std::nullopt, "the ray has no direction"};
  Placement placement =
      request.object ? OnObject(map, *request.object, request) : OnPoints(map, request);
  if (!placement.anchor) return placement;
  placement.anchor->model = request.model;
  if (request.size > 0) placement.anchor->size = request.size;
  return placement;
}

}  // namespace oaslam
