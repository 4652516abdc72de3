#include "oaslam/objects/sight_lines.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <vector>

#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

// In half axes of the ellipsoid: the middle; the largest distance from the centre of a landmark on
// the object; the least of one behind it. The gap between the last two covers errors of the
// ellipsoid.
constexpr double kMiddle = 0.5, kOnIt = 1.2, kBehind = 1.5;
// Depths of landmarks are uncertain by a share of their distance from the camera.
constexpr double kDepthMargin = 0.05;
// Times the distance of the farthest detection; from farther away its place is too small in the
// image.
constexpr double kFarther = 1.5;
// Landmarks that two sets of keyframes must share, as many as a loop needs.
constexpr int kMinCommon = 15;
// The share of lines through the place of an object that is gone; the rest may end on others there.
constexpr double kThroughWhereGone = 0.8;
// Prior on the share of lines through an object that is there: one in twenty, with the weight of
// ten lines.
constexpr double kPriorThrough = 0.5, kPriorLines = 10;

enum class Line { kElsewhere, kThrough, kStopped };

// Judges lines of sight in the coordinates in which the ellipsoid is the unit ball.
class SightLineJudge {
 public:
  explicit SightLineJudge(const Ellipsoid& ellipsoid)
      : center_(ellipsoid.center),
        ball_from_world_(ellipsoid.half_axes.cwiseInverse().asDiagonal() *
                         ellipsoid.rotation.toRotationMatrix().transpose()) {}

  Line Judge(const Eigen::Vector3d& eye, const Eigen::Vector3d& landmark) const {
    const Eigen::Vector3d from = ball_from_world_ * (eye - center_),
                          line = ball_from_world_ * (landmark - eye);
    if (from.norm() < kBehind)
      return Line::kElsewhere;  // a camera over a bed looks past its middle
    const double nearest = -from.dot(line) / line.squaredNorm();  // 0: the eye, 1: the landmark
    if (!(nearest > 0) || (from + nearest * line).norm() > kMiddle) return Line::kElsewhere;
    const double landmark_radius = (from + line).norm();
    if (landmark_radius < kOnIt) return Line::kStopped;
    const bool is_behind = nearest < 1 - kDepthMargin && landmark_radius > kBehind;
    return is_behind ? Line::kThrough : Line::kElsewhere;
  }

 private:
  Eigen::Vector3d center_;
  Eigen::Matrix3d ball_from_world_;
};

std::vector<KeyframeId> Detecting(const Map& map, const Object& object) {
  std::set<KeyframeId> keyframes;
  for (const ObjectObservation& o : object.observations)
    if (const auto carried = map.ResolveKeyframe(o.reference)) keyframes.insert(carried->by);
  return {keyframes.begin(), keyframes.end()};
}

double FarthestFrom(const Map& map, const Eigen::Vector3d& point,
                    std::span<const KeyframeId> keyframes) {
  double farthest = 0;
  for (const KeyframeId id : keyframes)
    farthest = std::max(farthest, (map.keyframes.At(id).cam_from_world * point).norm());
  return farthest;
}

// Whether a point is in the image, or not far beside it.
bool MaySee(const Map& map, const Keyframe& keyframe, const Eigen::Vector3d& point) {
  constexpr double kMargin = 0.25;  // of the image, for objects that reach into it
  const Eigen::Vector3d in_cam = keyframe.cam_from_world * point;
  if (in_cam.z() <= 0) return false;
  const Camera& camera = map.cameras.at(static_cast<size_t>(keyframe.camera));
  const double x = (camera.fx * in_cam.x() / in_cam.z() + camera.cx) / camera.width,
               y = (camera.fy * in_cam.y() / in_cam.z() + camera.cy) / camera.height;
  return std::min(x, y) > -kMargin && std::max(x, y) < 1 + kMargin;
}

int CountCommon(const Map& map, std::span<const KeyframeId> a, std::span<const KeyframeId> b) {
  const auto landmarks_of = [&](std::span<const KeyframeId> keyframes) {
    std::set<LandmarkId> seen;
    for (const KeyframeId id : keyframes)
      for (const LandmarkId landmark : map.keyframes.At(id).landmarks)
        if (landmark.IsValid()) seen.insert(landmark);
    return seen;
  };
  const std::set<LandmarkId> in_a = landmarks_of(a), in_b = landmarks_of(b);
  return static_cast<int>(
      std::ranges::count_if(in_a, [&](LandmarkId id) { return in_b.contains(id); }));
}

}  // namespace

std::vector<KeyframeId> WithNeighbours(const Map& map, std::span<const KeyframeId> keyframes) {
  constexpr int kNeighbours = 20;  // as many as a new keyframe is triangulated with
  std::set<KeyframeId> near(keyframes.begin(), keyframes.end());
  for (const KeyframeId id : keyframes)
    for (const KeyframeId neighbour : map.CovisibleKeyframes(id, kNeighbours))
      near.insert(neighbour);
  return {near.begin(), near.end()};
}

SightLines CountSightLines(const Map& map, const Ellipsoid& ellipsoid,
                           std::span<const KeyframeId> keyframes) {
  const SightLineJudge judge(ellipsoid);
  std::set<LandmarkId> through, stopped;
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = map.keyframes.At(id);
    const Eigen::Vector3d eye = keyframe.cam_from_world.OriginInSource();
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (!landmark.IsValid()) continue;
      const Line line = judge.Judge(eye, map.landmarks.At(landmark).position);
      if (line == Line::kThrough) through.insert(landmark);
      if (line == Line::kStopped) stopped.insert(landmark);
    }
  }
  return {static_cast<int>(through.size()), static_cast<int>(stopped.size())};
}

double SeenThroughEvidence(const Map& map, const Object& object,
                           std::span<const KeyframeId> keyframes) {
  const Eigen::Vector3d& center = object.ellipsoid.center;
  std::vector<KeyframeId> since;
  std::ranges::copy_if(keyframes, std::back_inserter(since), [&](KeyframeId id) {
    const Keyframe& keyframe = map.keyframes.At(id);
    return keyframe.frame_index > object.last_seen_frame && MaySee(map, keyframe, center);
  });
  if (since.empty()) return 0;
  const std::vector<KeyframeId> detecting = Detecting(map, object);
  const double reach = kFarther * FarthestFrom(map, center, detecting);
  std::erase_if(since, [&](KeyframeId id) {
    return (map.keyframes.At(id).cam_from_world * center).norm() > reach;
  });
  const SightLines lines = CountSightLines(map, object.ellipsoid, since);
  // From another side one may look through a part of a chair; what ends on it shows that it is
  // there.
  const bool is_clear =
      lines.through > 0 && lines.through >= kThroughWhereGone * (lines.through + lines.stopped);
  if (!is_clear || CountCommon(map, WithNeighbours(map, since), detecting) < kMinCommon) return 0;
  const SightLines before = CountSightLines(map, object.ellipsoid, detecting);
  const double share =
      (before.through + kPriorThrough) / (before.through + before.stopped + kPriorLines);
  if (share >= kThroughWhereGone) return 0;
  return lines.through * std::log(kThroughWhereGone / share) +
         lines.stopped * std::log((1 - kThroughWhereGone) / (1 - share));
}

}  // namespace oaslam
