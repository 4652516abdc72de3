#include "oaslam/bundle/bundle_adjustment.h"

#include <algorithm>
#include <map>

#include "oaslam/bundle/bundle_problem.h"
#include "oaslam/map/landmark_sets.h"

namespace oaslam {
namespace {

// The largest number of fixed keyframes. Those that share most landmarks with the free ones are
// used; more of them hardly add constraints.
constexpr size_t kMaxFixedKeyframes = 40;
constexpr double kLocalTolerance = 1e-3, kGlobalTolerance = 1e-4;

std::vector<KeyframeId> StrongestObservers(const Map& map, const std::vector<LandmarkId>& landmarks,
                                           const std::vector<KeyframeId>& except) {
  std::map<KeyframeId, int> shared;
  for (const LandmarkId id : landmarks)
    for (const Observation& o : map.landmarks.At(id).observations) ++shared[o.keyframe];
  for (const KeyframeId id : except) shared.erase(id);
  std::vector<std::pair<KeyframeId, int>> ranked(shared.begin(), shared.end());
  std::ranges::stable_sort(ranked, std::ranges::greater{},
                           [](const auto& entry) { return entry.second; });
  std::vector<KeyframeId> strongest;
  for (size_t i = 0; i < std::min(ranked.size(), kMaxFixedKeyframes); ++i)
    strongest.push_back(ranked[i].first);
  return strongest;
}

void SelectObjects(const Map& map, const std::string& how, BundleSelection& selection) {
  selection.free_objects = how == "full";
  if (how == "none") return;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    const auto is_free = [&](const ObjectObservation& o) {
      const auto carried = map.ResolveKeyframe(o.reference);
      return carried && std::ranges::binary_search(selection.free_keyframes, carried->by);
    };
    if (object.state == ObjectState::kMapped && std::ranges::any_of(object.observations, is_free))
      selection.objects.push_back(id);
  });
}

}  // namespace

BundleCorrection LocalBundleAdjustment(const Map& map, KeyframeId newest,
                                       const BundleConfig& config) {
  std::vector<KeyframeId> window = map.CovisibleKeyframes(newest, config.max_local_keyframes - 1);
  window.push_back(newest);
  std::ranges::sort(window);
  BundleSelection selection;
  selection.landmarks = LandmarksSeenBy(map, window);
  selection.fixed_keyframes = StrongestObservers(map, selection.landmarks, window);
  // Where no keyframe outside of the window sees its landmarks, the oldest keyframe of the window
  // is fixed; the scale is then constrained by the damping alone.
  const bool hold_oldest =
      window.front() == map.keyframes.First() || selection.fixed_keyframes.empty();
  if (hold_oldest) selection.fixed_keyframes.push_back(window.front());
  std::ranges::sort(selection.fixed_keyframes);
  selection.free_keyframes.assign(window.begin() + (hold_oldest ? 1 : 0), window.end());
  SelectObjects(map, config.objects, selection);
  return SolveBundle(map, selection, {config.local_iterations, kLocalTolerance});
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
  if (!corrected.keyframes.empty()) motions.try_emplace(corrected.keyframes.First());
  for (const KeyframeId id : map.keyframes.Ids()) {
    if (corrected.keyframes.Contains(id)) continue;
    Keyframe& late = map.keyframes.MutableAt(id);
    const auto neighbour = std::ranges::find_if(
        late.covisible, [&](const Covisible& c) { return motions.contains(c.keyframe); });
    if (neighbour == late.covisible.end()) continue;
    const Rigid3 motion = motions.at(neighbour->keyframe);
    motions[id] = motion;
    late.cam_from_world = late.cam_from_world * motion.Inverse();
  }
  for (const LandmarkId id : map.landmarks.Ids()) {
    if (corrected.landmarks.Contains(id)) continue;
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
  for (const LandmarkId id : map.landmarks.Ids())
    if (!corrected.landmarks.Contains(id)) map.UpdateLandmarkGeometry(id);
}

}  // namespace oaslam
