#include "oaslam/objects/presence.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/ideal_image.h"

namespace oaslam {
namespace {

constexpr double kSecondsPerView = 0.5;
constexpr double kFalseRate = 0.05;  // rate of detections in the place of an object that is gone
// Bounds on the detection rate; a higher measured rate may be chance.
constexpr double kMinRate = 0.1, kMaxRate = 0.8;
constexpr double kProven = 12;  // nats: on average e^12 views until the first false alarm
constexpr double kSameSide = 25 * std::numbers::pi / 180, kSameDistance = 1.6;
constexpr int kMinViewsFromHere = 3;

// The detection rate while the object was there: without the last misses in a row, which its
// absence may have caused.
double RateWhileThere(const Object& object) {
  const double hits = std::max(object.total_observations, 1),
               views = hits / object.detection_rate - object.misses;
  return std::clamp(hits / std::max(views, hits), kMinRate, kMaxRate);
}

// The keyframes before an image about which anything was detected that is not farther away from a
// place than `reach`.
std::set<KeyframeId> KeyframesBefore(const Map& map, int frame_index, const Eigen::Vector3d& place,
                                     double reach) {
  std::set<KeyframeId> earlier;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if ((object.ellipsoid.center - place).norm() > reach) return;
    for (const ObjectObservation& o : object.observations)
      if (const Keyframe* keyframe = map.keyframes.Find(o.reference);
          keyframe && keyframe->frame_index < frame_index)
        earlier.insert(o.reference);
  });
  return earlier;
}

// The largest distance from which an object was detected.
double FarthestView(const Map& map, const Object& object) {
  double farthest = 0;
  for (const ObjectObservation& o : object.observations)
    if (const auto reference_from_world = map.ResolvePose(o.reference))
      farthest =
          std::max(farthest,
                   (o.cam_from_reference * *reference_from_world * object.ellipsoid.center).norm());
  return farthest;
}

}  // namespace

double AbsenceEvidence(PlaceEvidence evidence, double interval_s, const Object& object) {
  constexpr double kRecognisedShare = 0.5;  // of the sides from which it was never detected
  const double rate = RateWhileThere(object);
  double gain = 0;
  switch (evidence) {
    case PlaceEvidence::kNone:
      break;
    case PlaceEvidence::kInPlace:
      gain = std::log(kFalseRate / rate);
      break;
    case PlaceEvidence::kAbsent:
      gain = std::log((1 - kFalseRate) / (1 - rate));
      break;
    case PlaceEvidence::kUnrecognised:
      gain = std::max(std::log((1 - kFalseRate) / (1 - kRecognisedShare * rate)), 0.0);
      break;
  }
  return gain * std::min(interval_s / kSecondsPerView, 1.0);
}

void WeighPlace(PlaceEvidence evidence, double interval_s, Object& object) {
  const double gain = AbsenceEvidence(evidence, interval_s, object);
  if (evidence != PlaceEvidence::kUnrecognised)
    object.absence = std::max(object.absence + gain, 0.0);
  object.absence_from_any_side = std::max(object.absence_from_any_side + gain, 0.0);
}

bool IsProvenAbsent(double absence) { return absence > kProven; }

bool LooksAt(const Map& map, const Camera& camera, const Rigid3& cam_from_world,
             std::span<const LandmarkId> landmarks, const Ellipsoid& ellipsoid) {
  // A small thing has few landmarks: those around it, up to its own size away, tell as well.
  constexpr int kFewLandmarks = 3;
  const auto box = ProjectToBox(ellipsoid, cam_from_world, camera);
  if (!box || SizeOf(*box) < kMinMissedSize * DetectorPixel(camera) ||
      IdealImage(camera).ShareShown(*box) < kWellInsideShare)
    return false;
  const double nearest = (cam_from_world * ellipsoid.center).z() - ellipsoid.half_axes.maxCoeff();
  int nearer = 0, inside = 0;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = id.IsValid() ? map.landmarks.Find(id) : nullptr;
    if (!landmark) continue;
    const Eigen::Vector3d point = cam_from_world * landmark->position;
    const Eigen::Vector2d pixel = ProjectIdeal(camera, point);
    const double x = pixel.x() + kBoxFromPixel, y = pixel.y() + kBoxFromPixel;
    if (std::abs(x - box->Center().x()) > 1.5 * box->Width() ||
        std::abs(y - box->Center().y()) > 1.5 * box->Height())
      continue;
    nearer += point.z() < nearest;
    ++inside;
  }
  return (inside >= kFewLandmarks || map.landmarks.empty()) && nearer <= kMaxHiddenShare * inside;
}

double ArrivalEvidence(const Map& map, const Object& object) {
  if (object.observations.empty()) return 0;
  const std::set<KeyframeId> earlier =
      KeyframesBefore(map, object.observations.front().frame_index, object.ellipsoid.center,
                      FarthestView(map, object));
  double evidence = 0;
  std::optional<double> last_time;
  for (const KeyframeId id : earlier) {
    const Keyframe& keyframe = map.keyframes.At(id);
    if (!LooksAt(map, map.cameras[keyframe.camera], keyframe.cam_from_world, keyframe.landmarks,
                 object.ellipsoid))
      continue;
    const double interval = last_time ? std::abs(keyframe.timestamp - *last_time) : kSecondsPerView;
    evidence += AbsenceEvidence(WasSeenFrom(map, object, keyframe.cam_from_world)
                                    ? PlaceEvidence::kAbsent
                                    : PlaceEvidence::kUnrecognised,
                                interval, object);
    last_time = keyframe.timestamp;
  }
  return evidence;
}

bool WasSeenFrom(const Map& map, const Object& object, const Rigid3& cam_from_world) {
  const Eigen::Vector3d& center = object.ellipsoid.center;
  const Eigen::Vector3d here = cam_from_world.OriginInSource() - center;
  int views = 0;
  for (const ObjectObservation& o : object.observations) {
    const auto reference_from_world = map.ResolvePose(o.reference);
    if (!reference_from_world) continue;
    const Eigen::Vector3d there =
        (o.cam_from_reference * *reference_from_world).OriginInSource() - center;
    const double farther = here.norm() / there.norm();
    const bool is_near = farther < kSameDistance && farther > 1 / kSameDistance;
    views += is_near && here.dot(there) > std::cos(kSameSide) * here.norm() * there.norm();
    if (views >= kMinViewsFromHere) return true;
  }
  return false;
}

double HiddenShare(const Box& box, std::span<const Box> nearer) {
  double hidden = 0;
  for (const Box& other : nearer) hidden += ShareInside(box, other);
  return std::min(hidden, 1.0);
}

}  // namespace oaslam
