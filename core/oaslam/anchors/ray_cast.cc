#include "oaslam/anchors/ray_cast.h"

#include <algorithm>
#include <cmath>

#include "oaslam/anchors/placement.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

// The front of an ellipsoid; nothing where the ray passes it or begins in it.
std::optional<RayHit> HitOf(const Ellipsoid& e, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction) {
  const Eigen::Matrix3d world_from_unit = ScaledAxes(e),
                        unit_from_world = world_from_unit.inverse();
  const Eigen::Vector3d from = unit_from_world * (origin - e.center),
                        along = unit_from_world * direction;
  const double a = along.squaredNorm(), b = from.dot(along), c = from.squaredNorm() - 1;
  const double discriminant = b * b - a * c;
  if (c <= 0 || !(discriminant >= 0)) return std::nullopt;
  const double distance = (-b - std::sqrt(discriminant)) / a;
  if (!(distance > 0)) return std::nullopt;
  RayHit hit{
      .kind = HitKind::kObject, .distance = distance, .position = origin + distance * direction};
  hit.normal = (unit_from_world.transpose() * (from + distance * along)).normalized();
  return hit;
}

// Of the landmarks within a degree of the ray the one that is nearest to it, by its angle.
std::optional<RayHit> NearestLandmark(const Map& map, const Eigen::Vector3d& origin,
                                      const Eigen::Vector3d& direction) {
  double best = std::cos(1 * kDegree);
  std::optional<RayHit> hit;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    const Eigen::Vector3d way = landmark.position - origin;
    const double distance = way.norm();
    if (!(way.dot(direction) > best * distance)) return;
    best = way.dot(direction) / distance;
    hit = RayHit{.kind = HitKind::kLandmark,
                 .distance = distance,
                 .position = landmark.position,
                 .landmark = id};
  });
  return hit;
}

}  // namespace

std::vector<RayHit> CastRay(const Map& map, const Eigen::Vector3d& origin,
                            const Eigen::Vector3d& direction) {
  const Eigen::Vector3d unit = direction.normalized();
  std::vector<RayHit> hits;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    std::optional<RayHit> hit = HitOf(object.ellipsoid, origin, unit);
    if (!hit) return;
    hit->object = id;
    hits.push_back(*hit);
  });
  if (const std::optional<MapSurface> surface = SurfaceAlong(map, origin, unit)) {
    const double away = (surface->point - origin).norm();
    const double side = surface->normal.dot(unit) <= 0 ? 1 : -1;
    hits.push_back({.kind = HitKind::kPlane,
                    .distance = away,
                    .position = surface->point,
                    .normal = side * surface->normal});
  }
  if (const std::optional<RayHit> hit = NearestLandmark(map, origin, unit)) hits.push_back(*hit);
  std::ranges::stable_sort(hits, {}, &RayHit::distance);
  return hits;
}

}  // namespace oaslam
