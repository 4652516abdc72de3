#include "oaslam/objects/presence.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "oaslam/geometry/box.h"

namespace oaslam {
namespace {

// Detectors miss an object for several images in a row (presence.h).
constexpr double kSecondsPerView = 0.5;
// Rate of false detections in the place of an object that is gone.
constexpr double kFalseRate = 0.05;
// Bounds on the detection rate; a higher measured rate may be chance.
constexpr double kMinRate = 0.1, kMaxRate = 0.8;
constexpr double kProven = 12;  // nats: on average e^12 views until the first false alarm
// Viewing angle and ratio of distances within which a detector sees about the same image.
constexpr double kSameSide = 25 * std::numbers::pi / 180, kSameDistance = 1.6;
constexpr int kMinViewsFromHere = 3;  // one or two detections may have been false

// The detection rate while the object was there: without the last misses in a row, which its
// absence may have caused.
double RateWhileThere(const Object& object) {
  const double hits = std::max(object.total_observations, 1),
               views = hits / object.detection_rate - object.misses;
  return std::clamp(hits / std::max(views, hits), kMinRate, kMaxRate);
}

}  // namespace

double AbsenceEvidence(PlaceEvidence evidence, double interval_s, const Object& object) {
  if (evidence == PlaceEvidence::kNone) return 0;
  const double rate = RateWhileThere(object);
  const double gain = evidence == PlaceEvidence::kAbsent ? std::log((1 - kFalseRate) / (1 - rate))
                                                         : std::log(kFalseRate / rate);
  return gain * std::min(interval_s / kSecondsPerView, 1.0);
}

void WeighPlace(PlaceEvidence evidence, double interval_s, Object& object) {
  object.absence = std::max(object.absence + AbsenceEvidence(evidence, interval_s, object), 0.0);
}

bool IsProvenAbsent(double absence) { return absence > kProven; }

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
