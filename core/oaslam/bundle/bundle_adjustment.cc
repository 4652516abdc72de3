#include "oaslam/bundle/bundle_adjustment.h"

#include <algorithm>
#include <map>

#include "oaslam/bundle/bundle_problem.h"
#include "oaslam/map/landmark_sets.h"

namespace oaslam {
namespace {

// The largest number of fixed keyframes of a local adjustment. Those that share most landmarks with
// the free ones are used; more of them hardly add constraints.
constexpr size_t kMaxFixedKeyframes = 40;
// Maps with more keyframes are adjusted in windows of this many, each with as many fixed ones at
// most as one in four.
constexpr size_t kLargeMap = 500, kWindow = 250, kMaxFixedOfWindow = kWindow / 4;
// A local adjustment is soon followed by the next one, which goes on where it ended.
constexpr double kLocalTolerance = 1e-3, kGlobalTolerance = 1e-4;

std::vector<KeyframeId> StrongestObservers(const Map& map, const std::vector<LandmarkId>& landmarks,
                                           const std::vector<KeyframeId>& except, size_t most) {
  std::map<KeyframeId, int> shared;
  for (const LandmarkId id : landmarks)
    for (const Observation& o : map.landmarks.At(id).observations) ++shared[o.keyframe];
  for (const KeyframeId id : except) shared.erase(id);
  std::vector<std::pair<KeyframeId, int>> ranked(shared.begin(), shared.end());
  std::ranges::stable_sort(ranked, std::ranges::greater{},
                           [](const auto& entry) { return entry.second; });
  std::vector<KeyframeId> strongest;
  for (size_t i = 0; i < std::min(ranked.size(), most); ++i) strongest.push_back(ranked[i].first);
  return strongest;
}

void SelectObjects(const Map& map, BundleObjects how, BundleSelection& selection) {
  selection.free_objects = how == BundleObjects::kFull;
  if (how == BundleObjects::kNone) return;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    const auto is_free = [&](const ObjectObservation& o) {
      const auto carried = map.ResolveKeyframe(o.reference);
      return carried && std::ranges::binary_search(selection.free_keyframes, carried->by);
    };
    if (object.state == ObjectState::kMapped && std::ranges::any_of(object.observations, is_free))
      selection.objects.push_back(id);
  });
}

// The ids of `table` that an earlier copy of it lacks.
template <typename Id, typename T>
std::vector<Id> AddedTo(const Table<Id, T>& table, const Table<Id, T>& earlier) {
  std::vector<Id> added;
  table.ForEachDifference(earlier, [&](Id id, const T* before, const T* now) {
    if (!before && now) added.push_back(id);
  });
  return added;
}

}  // namespace

BundleCorrection LocalBundleAdjustment(const Map& map, KeyframeId newest,
                                       const BundleConfig& config, int max_keyframes) {
  constexpr int kIterations = 10;  // at most; it ends earlier where the error no longer falls
  std::vector<KeyframeId> window = map.KeyframesAround(newest, max_keyframes - 1);
  std::ranges::sort(window);
  BundleSelection selection;
  selection.landmarks = LandmarksSeenBy(map, window);
  selection.fixed_keyframes =
      StrongestObservers(map, selection.landmarks, window, kMaxFixedKeyframes);
  // Where no keyframe outside of the window sees its landmarks, the oldest keyframe of the window
  // is fixed; the scale is then constrained by the damping alone.
  const bool hold_oldest =
      window.front() == map.keyframes.First() || selection.fixed_keyframes.empty();
  if (hold_oldest) selection.fixed_keyframes.push_back(window.front());
  std::ranges::sort(selection.fixed_keyframes);
  selection.free_keyframes.assign(window.begin() + (hold_oldest ? 1 : 0), window.end());
  SelectObjects(map, config.objects, selection);
  return SolveBundle(map, selection, {kIterations, kLocalTolerance});
}

BundleCorrection GlobalBundleAdjustment(const Map& map, int iterations, const BundleConfig& config,
                                        const std::stop_token& stop) {
  BundleSelection selection;
  selection.free_keyframes = map.keyframes.Ids();
  if (selection.free_keyframes.empty()) return {};
  selection.fixed_keyframes = {selection.free_keyframes.front()};
  selection.free_keyframes.erase(selection.free_keyframes.begin());
  selection.landmarks = map.landmarks.Ids();
  SelectObjects(map, config.objects, selection);
  return SolveBundle(map, selection, {iterations, kGlobalTolerance, stop});
}

std::vector<std::vector<KeyframeId>> AdjustmentWindows(const Map& map) {
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  if (ids.size() <= kLargeMap) return {ids};
  std::vector<std::vector<KeyframeId>> windows;
  for (size_t end = ids.size(); end > 0;) {
    const size_t begin = end < 2 * kWindow ? 0 : end - kWindow;
    windows.emplace_back(ids.begin() + static_cast<std::ptrdiff_t>(begin),
                         ids.begin() + static_cast<std::ptrdiff_t>(end));
    end = begin;
  }
  return windows;
}

BundleCorrection WindowBundleAdjustment(const Map& map, const std::vector<KeyframeId>& window,
                                        int iterations, const BundleConfig& config,
                                        const std::stop_token& stop) {
  if (window == map.keyframes.Ids()) return GlobalBundleAdjustment(map, iterations, config, stop);
  BundleSelection selection;
  for (const KeyframeId id : window)
    if (map.keyframes.Contains(id) && id != map.keyframes.First())
      selection.free_keyframes.push_back(id);
  if (selection.free_keyframes.empty()) return {};
  selection.landmarks = LandmarksSeenBy(map, selection.free_keyframes);
  selection.fixed_keyframes =
      StrongestObservers(map, selection.landmarks, selection.free_keyframes, kMaxFixedOfWindow);
  if (selection.fixed_keyframes.empty()) {
    selection.fixed_keyframes = {selection.free_keyframes.front()};
    selection.free_keyframes.erase(selection.free_keyframes.begin());
  }
  std::ranges::sort(selection.fixed_keyframes);
  SelectObjects(map, config.objects, selection);
  return SolveBundle(map, selection, {iterations, kGlobalTolerance, stop});
}

void ApplyCorrection(const BundleCorrection& correction, Map& map) {
  for (const auto& [id, pose] : correction.poses)
    if (Keyframe* keyframe = map.keyframes.Mutable(id)) keyframe->cam_from_world = pose;
  for (const auto& [id, point] : correction.points)
    if (Landmark* landmark = map.landmarks.Mutable(id)) landmark->position = point;
  for (const auto& [id, ellipsoid] : correction.objects)
    if (Object* object = map.objects.Mutable(id)) object->ellipsoid = ellipsoid;
  for (const auto& [landmark, keyframe] : correction.outliers)
    map.EraseObservation(landmark, keyframe);
  for (const auto& [id, point] : correction.points)
    if (map.landmarks.Contains(id)) map.UpdateLandmarkGeometry(id);
}

void ApplyLateCorrection(const BundleCorrection& correction, const Map& corrected, Map& map) {
  std::map<KeyframeId, Rigid3> motions;  // new_world_from_old_world
  for (const auto& [id, pose] : correction.poses)
    if (const Keyframe* keyframe = map.keyframes.Find(id))
      motions[id] = pose.Inverse() * keyframe->cam_from_world;
  // Keyframes outside of the window have not moved.
  corrected.keyframes.ForEach([&](KeyframeId id, const Keyframe&) { motions.try_emplace(id); });
  for (const KeyframeId id : AddedTo(map.keyframes, corrected.keyframes)) {
    Keyframe& late = map.keyframes.MutableAt(id);
    const auto neighbour = std::ranges::find_if(
        late.covisible, [&](const Covisible& c) { return motions.contains(c.keyframe); });
    if (neighbour == late.covisible.end()) continue;
    const Rigid3 motion = motions.at(neighbour->keyframe);
    motions[id] = motion;
    late.cam_from_world = late.cam_from_world * motion.Inverse();
  }
  const std::vector<LandmarkId> added = AddedTo(map.landmarks, corrected.landmarks);
  for (const LandmarkId id : added) {
    Landmark& late = map.landmarks.MutableAt(id);
    const auto by = std::ranges::find_if(
        late.observations, [&](const Observation& o) { return motions.contains(o.keyframe); });
    if (by != late.observations.end()) late.position = motions.at(by->keyframe) * late.position;
  }
  BundleCorrection of_points = correction;
  // Objects that were seen since have been fitted to more boxes than this correction knew. The
  // caller fits all objects again whose keyframes have moved.
  of_points.objects.clear();
  ApplyCorrection(of_points, map);
  for (const LandmarkId id : added)
    if (map.landmarks.Contains(id)) map.UpdateLandmarkGeometry(id);
}

}  // namespace oaslam
