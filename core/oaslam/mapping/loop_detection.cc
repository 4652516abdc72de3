
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "oaslam/mapping/loop_closing.h"
#include "oaslam/mapping/loop_objects.h"
#include "oaslam/mapping/loop_proposals.h"
#include "oaslam/mapping/loop_verification.h"
#include "oaslam/util/id_set.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

constexpr double kMaxDistanceToDepth = 0.5;  // from farther away, descriptors hardly match
constexpr double kMinAxisCos = 0.8;          // 37 degrees; more, and the views hardly overlap
constexpr uint32_t kMinKeyframesApart = 15;  // a shorter loop has hardly any drift
constexpr uint32_t kEvery = 3;  // keyframes between two searches: a place stays in view for several
constexpr int kMaxCandidates = 3;  // to verify for a keyframe, which takes time

using KeyframePlaces = std::map<KeyframeId, KeyframePlace>;

KeyframePlace PlaceOf(const Keyframe& keyframe) {
  return {keyframe.cam_from_world.OriginInSource(),
          keyframe.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ()};
}

// Decides whether a keyframe may be the other end of a loop: it is old enough and not linked with
// the current one by two steps in the covisibility graph.
class OtherEnds {
 public:
  OtherEnds(const Map& map, KeyframeId current) : current_(current) {
    for (const Covisible& c : map.keyframes.At(current).covisible) {
      linked_.Insert(c.keyframe);
      for (const Covisible& second : map.keyframes.At(c.keyframe).covisible)
        linked_.Insert(second.keyframe);
    }
  }
  bool Contains(KeyframeId id) const {
    return id.value + kMinKeyframesApart <= current_.value && !linked_.Contains(id);
  }

 private:
  KeyframeId current_;
  IdSet<KeyframeId> linked_;
};

// The keyframes near the current one among those that `is_candidate` accepts, nearest first.
template <typename Predicate>
std::vector<KeyframeId> NearInSpace(const Map& map, const KeyframePlaces& places,
                                    KeyframeId current, Predicate&& is_candidate) {
  const double reach = kMaxDistanceToDepth * map.MedianDepth(current);
  const KeyframePlace here = PlaceOf(map.keyframes.At(current));
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& [id, there] : places) {
    const double distance = (there.center - here.center).norm();
    if (distance < reach && here.axis.dot(there.axis) >= kMinAxisCos && is_candidate(id))
      near.emplace_back(distance, id);
  }
  std::ranges::sort(near);
  std::vector<KeyframeId> ids;
  for (const auto& [distance, id] : near)
    if (static_cast<int>(ids.size()) < kMaxCandidates) ids.push_back(id);
  return ids;
}

// The length of the camera's path between two keyframes.
double PathLength(const Map& map, KeyframeId a, KeyframeId b) {
  const auto [from, to] = std::minmax(a, b);
  double length = 0;
  std::optional<Eigen::Vector3d> before;
  for (KeyframeId id = from; id <= to; ++id.value) {
    const Keyframe* keyframe = map.keyframes.Find(id);
    if (!keyframe) continue;
    const Eigen::Vector3d center = keyframe->cam_from_world.OriginInSource();
    if (before) length += (center - *before).norm();
    before = center;
  }
  return length;
}

// How far the loop's correction moves the camera of its current keyframe.
double DistanceMoved(const Map& map, const LoopClosure& loop) {
  const Eigen::Vector3d center = map.keyframes.At(loop.current).cam_from_world.OriginInSource();
  return (loop.old_from_current * center - center).norm();
}

// Whether drift explains the correction: drift is a share of the path travelled (tuned on walk a,
// docs/lab/loops.md). A larger correction means that two different places look the same, such as
// two windows.
bool IsDrift(const Map& map, const LoopClosure& loop) {
  constexpr double kMaxShare = 0.25;
  return DistanceMoved(map, loop) < kMaxShare * PathLength(map, loop.old, loop.current) &&
         IsTurnAndScaleOfDrift(loop.old_from_current);
}

bool IsBelieved(const Map& map, const LoopClosure& loop) {
  if (!IsDrift(map, loop)) return false;
  const LoopObjects objects = CompareObjects(map, loop);
  Log(LogLevel::kDebug,
      "loop from keyframe {} to {} by {} landmarks: {} objects agree, {} contradict",
      loop.current.value, loop.old.value, loop.old_landmarks.size(), objects.agreeing,
      objects.contradicting);
  return !AreObjectsAgainst(objects);
}

// Whether the correction is as small as the error of joining submaps.
bool IsSmall(const Map& map, const LoopClosure& tie) {
  constexpr double kMaxAngle = 0.3, kMaxScale = 1.3;
  return DistanceMoved(map, tie) < kMaxDistanceToDepth * map.MedianDepth(tie.old) &&
         tie.old_from_current.rotation.angularDistance(Eigen::Quaterniond::Identity()) <
             kMaxAngle &&
         std::abs(std::log(tie.old_from_current.scale)) < std::log(kMaxScale);
}

// The keyframes that show most of the objects, those that look most like `expected` first.
std::vector<KeyframeId> KeyframesThatShow(const Map& map, std::span<const ObjectId> objects,
                                          const Rigid3& expected, double depth) {
  std::map<KeyframeId, int> shown;
  for (const ObjectId id : objects) {
    std::set<KeyframeId> by;
    for (const ObjectObservation& o : map.objects.At(id).observations)
      if (const auto carried = map.ResolveKeyframe(o.reference)) by.insert(carried->by);
    for (const KeyframeId keyframe : by) ++shown[keyframe];
  }
  int most = 0;
  for (const auto& [id, count] : shown) most = std::max(most, count);
  const Eigen::Vector3d axis = expected.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  std::vector<std::pair<double, KeyframeId>> ranked;
  for (const auto& [id, count] : shown) {
    if (2 * count < most) continue;
    const KeyframePlace place = PlaceOf(map.keyframes.At(id));
    ranked.emplace_back(
        (place.center - expected.OriginInSource()).norm() / depth - place.axis.dot(axis), id);
  }
  std::ranges::sort(ranked);
  std::vector<KeyframeId> ids;
  for (const auto& [difference, id] : ranked) ids.push_back(id);
  return ids;
}

}  // namespace

void LoopDetector::UpdateIndex(const Map& map, KeyframeId current) {
  // The index is rebuilt when the landmarks have grown by this factor; a loop does not need the
  // newest ones.
  constexpr double kGrowth = 1.2;
  constexpr size_t kLarge = 30000;             // landmarks; an index of fewer takes some 30 ms
  constexpr uint32_t kKeyframesToMakeIt = 30;  // some seconds, in which the thread is done
  if (next_index_.valid() && current.value >= next_begun_at_.value + kKeyframesToMakeIt) {
    index_ = next_index_.get();
  }
  if (next_index_.valid() || (index_ && map.next_landmark <= kGrowth * indexed_up_to_)) return;
  indexed_up_to_ = map.next_landmark;
  if (map.landmarks.size() < kLarge) {
    index_.emplace(map);
    return;
  }
  next_begun_at_ = current;
  next_index_ = std::async(std::launch::async, [map] { return PlaceIndex(map); });
}

std::vector<Place> LoopDetector::LookingAlike(const Map& map, KeyframeId current) {
  if (map.keyframes.size() < 2 * kMinKeyframesApart || current.value % kEvery != 0) return {};
  UpdateIndex(map, current);
  if (!index_) return {};
  return index_->RankPlaces(map, index_->Find(*map.keyframes.At(current).features),
                            std::numeric_limits<int>::max());
}

// Looks only at keyframes that may have changed since the last call.
void LoopDetector::UpdatePlaces(const Map& map) {
  map.keyframes.ForEachDifference(known_, [&](KeyframeId id, const Keyframe*, const Keyframe* now) {
    if (now)
      places_.insert_or_assign(id, PlaceOf(*now));
    else
      places_.erase(id);
  });
  known_ = map.keyframes;
}

std::optional<LoopClosure> LoopDetector::DetectByObjects(
    const Map& map, KeyframeId current, const std::function<bool(KeyframeId)>& is_candidate) {
  if (current.value % kEvery != 0) return std::nullopt;
  const auto proposal = proposals_.Find(map, current, kMinKeyframesApart);
  if (!proposal) return std::nullopt;
  const Keyframe& here = map.keyframes.At(current);
  const Rigid3 expected = MovedCamera(here, proposal->old_from_current);
  const double depth = proposal->old_from_current.scale * map.MedianDepth(current);
  // Its own generator, so that refused proposals do not change other random numbers.
  Rng rng(current.value);
  int tried = 0;
  for (const KeyframeId old : KeyframesThatShow(map, proposal->old_objects, expected, depth)) {
    if (!is_candidate(old)) continue;
    if (++tried > kMaxCandidates) break;
    const auto loop = VerifyLoop(map, current, {old, false, proposal->old_from_current}, rng);
    Log(LogLevel::kDebug, "{} objects propose a loop from keyframe {} to {}: {}",
        proposal->old_objects.size(), current.value, old.value,
        loop ? "points agree" : "points do not show it");
    if (loop && IsBelieved(map, *loop)) return loop;
  }
  return std::nullopt;
}

std::optional<LoopClosure> LoopDetector::Detect(const Map& map, KeyframeId current, Rng& rng) {
  if (!map.keyframes.Contains(current)) return std::nullopt;
  UpdatePlaces(map);
  const OtherEnds others(map, current);
  const std::vector<KeyframeId> near =
      NearInSpace(map, places_, current, [&](KeyframeId id) { return others.Contains(id); });
  for (const KeyframeId old : near)
    if (auto loop = VerifyLoop(map, current, {old, true}, rng); loop && IsBelieved(map, *loop))
      return loop;
  int tried = 0;
  for (const Place& place : LookingAlike(map, current)) {
    const KeyframeId old = place.keyframes.front();
    if (!others.Contains(old)) continue;
    if (++tried > kMaxCandidates) break;
    if (std::ranges::find(near, old) != near.end()) continue;
    if (auto loop = VerifyLoop(map, current, {old}, rng); loop && IsBelieved(map, *loop))
      return loop;
  }
  return DetectByObjects(map, current, [&](KeyframeId id) { return others.Contains(id); });
}

std::optional<LoopClosure> FindTie(const Map& map, KeyframeId current,
                                   const std::set<KeyframeId>& others, Rng& rng) {
  KeyframePlaces places;
  for (const KeyframeId id : others)
    if (const Keyframe* keyframe = map.keyframes.Find(id)) places.emplace(id, PlaceOf(*keyframe));
  for (const KeyframeId old : NearInSpace(map, places, current, [](KeyframeId) { return true; }))
    if (auto tie = VerifyLoop(map, current, {old, true}, rng); tie && IsSmall(map, *tie))
      return tie;
  return std::nullopt;
}

}  // namespace oaslam
