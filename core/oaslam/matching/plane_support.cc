#include "oaslam/matching/plane_support.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "oaslam/geometry/decompositions.h"

namespace oaslam {
namespace {

struct Plane {
  Eigen::Vector3d normal, point;
  double DistanceTo(const Eigen::Vector3d& x) const { return std::abs(normal.dot(x - point)); }
};

// The plane with the least squared distances to the points nearer than `near` to the one before.
std::optional<Plane> Fit(std::span<const Eigen::Vector3d> points,
                         const std::optional<Plane>& before, double near) {
  const auto is_used = [&](const Eigen::Vector3d& x) {
    return !before || before->DistanceTo(x) < near;
  };
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const Eigen::Vector3d& x : points)
    if (is_used(x)) sum += x, ++count;
  if (count < 4) return std::nullopt;  // three lie in a plane always
  const Eigen::Vector3d mean = sum / count;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : points)
    if (is_used(x)) scatter += (x - mean) * (x - mean).transpose();
  return Plane{EigenOfSymmetric(scatter).vectors.col(0), mean};
}

// Nearer to the plane than this share of the distance, points found and points expected are in it.
constexpr double kNear = 0.03, kNearExpected = 0.05;

// Of most of the points.
std::optional<Plane> MainPlane(std::span<const Eigen::Vector3d> points, double distance) {
  std::optional<Plane> plane = Fit(points, std::nullopt, 0);
  for (const double near : {0.1, 0.05, kNear})
    if (plane) plane = Fit(points, plane, near * distance);
  return plane;
}

double CountNear(const Plane& plane, std::span<const Eigen::Vector3d> points, double near) {
  return static_cast<double>(std::ranges::count_if(
      points, [&](const Eigen::Vector3d& x) { return plane.DistanceTo(x) < near; }));
}

}  // namespace

bool PlaneSupport::IsOfOnePlane() const {
  constexpr double kLeast = 8;     // fewer may be missed by chance
  constexpr double kShare = 0.05;  // of those expected
  return expected_beside >= kLeast && beside < kShare * expected_beside;
}

PlaneSupport BesideThePlane(std::span<const Eigen::Vector3d> found,
                            std::span<const Eigen::Vector3d> expected, double distance) {
  constexpr double kFew = 5;  // so that a share of few expected ones does not count much
  const std::optional<Plane> plane = MainPlane(found, distance);
  if (!plane) return {};
  const double in_plane = CountNear(*plane, found, kNear * distance),
               expected_in = CountNear(*plane, expected, kNearExpected * distance);
  return {static_cast<int>(static_cast<double>(found.size()) - in_plane),
          in_plane / (expected_in + kFew) * (static_cast<double>(expected.size()) - expected_in)};
}

bool IsFlat(std::span<const Eigen::Vector3d> found, double distance) {
  constexpr double kFewest = 8, kShareBeside = 0.05;  // fewer beside the plane are wrong matches
  const std::optional<Plane> plane = MainPlane(found, distance);
  if (!plane) return false;
  // The wider distance, since noise would pass the narrower one in one of many images.
  const auto count = static_cast<double>(found.size());
  return count - CountNear(*plane, found, kNearExpected * distance) <
         std::max(kFewest, kShareBeside * count);
}

bool IsOneWall(std::span<const Eigen::Vector3d> landmarks, double distance) {
  const std::optional<Plane> plane = MainPlane(landmarks, distance);
  return plane && 2 * CountNear(*plane, landmarks, kNearExpected * distance) >
                      static_cast<double>(landmarks.size());
}

}  // namespace oaslam
