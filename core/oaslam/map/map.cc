#include "oaslam/map/map.h"

#include <algorithm>
#include <limits>
#include <map>

#include "oaslam/util/check.h"
#include "oaslam/util/median.h"

namespace oaslam {

const char* ToString(ObjectState state) {
  switch (state) {
    case ObjectState::kTentative:
      return "tentative";
    case ObjectState::kInitialized:
      return "initialized";
    case ObjectState::kMapped:
      break;
  }
  return "mapped";
}

std::optional<Map::Carried> Map::ResolveKeyframe(KeyframeId id) const {
  Carried carried{id, {}};
  for (size_t links = 0; !keyframes.Contains(carried.by); ++links) {
    const RetiredKeyframe* link = retired.Find(carried.by);
    if (!link || links == retired.size()) return std::nullopt;  // the chain ends or is a cycle
    carried = {link->parent, carried.cam_from_carrier * link->cam_from_parent};
  }
  return carried;
}

std::optional<Rigid3> Map::ResolvePose(KeyframeId id) const {
  const std::optional<Carried> carried = ResolveKeyframe(id);
  if (!carried) return std::nullopt;
  return carried->cam_from_carrier * keyframes.At(carried->by).cam_from_world;
}

std::optional<ObjectId> Map::ResolveObject(ObjectId id) const {
  while (const ObjectId* next = merged_objects.Find(id)) id = *next;
  if (objects.Contains(id)) return id;
  return std::nullopt;
}

int Map::IndexOf(const Camera& camera) const {
  const auto place = std::ranges::find(cameras, camera);
  OASLAM_CHECK(place != cameras.end());
  return static_cast<int>(place - cameras.begin());
}

bool Map::HasCamera(const Camera& camera) const {
  return std::ranges::find(cameras, camera) != cameras.end();
}

int Map::AddCamera(const Camera& camera) {
  if (!HasCamera(camera)) cameras.push_back(camera);
  return IndexOf(camera);
}

LandmarkId Map::AddLandmark(const Eigen::Vector3d& position, KeyframeId first_keyframe) {
  const LandmarkId id(next_landmark++);
  Landmark landmark;
  landmark.position = position;
  landmark.first_keyframe = first_keyframe;
  landmarks.Insert(id, std::move(landmark));
  return id;
}

bool Map::AddObservation(LandmarkId landmark_id, KeyframeId keyframe_id, uint32_t keypoint) {
  const Landmark* seen = landmarks.Find(landmark_id);
  const Keyframe* by = keyframes.Find(keyframe_id);
  if (!seen || !by || by->landmarks[keypoint].IsValid()) return false;
  const auto place =
      std::ranges::lower_bound(seen->observations, keyframe_id, {}, &Observation::keyframe);
  if (place != seen->observations.end() && place->keyframe == keyframe_id) return false;
  const auto offset = place - seen->observations.begin();
  auto& observations = landmarks.MutableAt(landmark_id).observations;
  observations.insert(observations.begin() + offset, {keyframe_id, keypoint});
  keyframes.MutableAt(keyframe_id).landmarks[keypoint] = landmark_id;
  return true;
}

void Map::EraseObservation(LandmarkId landmark_id, KeyframeId keyframe_id) {
  Landmark* landmark = landmarks.Mutable(landmark_id);
  if (!landmark) return;
  const auto place = std::ranges::find(landmark->observations, keyframe_id, &Observation::keyframe);
  if (place == landmark->observations.end()) return;
  keyframes.MutableAt(keyframe_id).landmarks[place->keypoint] = LandmarkId();
  landmark->observations.erase(place);
  if (landmark->observations.size() < 2) EraseLandmark(landmark_id);
}

void Map::EraseLandmark(LandmarkId id) {
  const Landmark* landmark = landmarks.Find(id);
  if (!landmark) return;
  for (const Observation& o : landmark->observations)
    keyframes.MutableAt(o.keyframe).landmarks[o.keypoint] = LandmarkId();
  landmarks.Erase(id);
}

void Map::MergeLandmarks(LandmarkId from, LandmarkId to) {
  if (from == to || !landmarks.Contains(from) || !landmarks.Contains(to)) return;
  const Landmark old = landmarks.At(from);
  EraseLandmark(from);
  for (const Observation& o : old.observations) AddObservation(to, o.keyframe, o.keypoint);
  Landmark& kept = landmarks.MutableAt(to);
  kept.visible += old.visible;
  kept.found += old.found;
  UpdateLandmark(to);
}

void Map::RetireKeyframe(KeyframeId id) {
  const Keyframe keyframe = keyframes.At(id);
  KeyframeId parent;
  if (!keyframe.covisible.empty()) {
    parent = keyframe.covisible.front().keyframe;
  } else {
    keyframes.ForEach([&](KeyframeId other, const Keyframe&) {
      if (other != id && (!parent.IsValid() || other < id)) parent = other;
    });
  }
  OASLAM_CHECK(parent.IsValid());
  for (const LandmarkId landmark : keyframe.landmarks)
    if (landmark.IsValid()) EraseObservation(landmark, id);
  for (const Covisible& c : keyframe.covisible)
    std::erase_if(keyframes.MutableAt(c.keyframe).covisible,
                  [&](const Covisible& back) { return back.keyframe == id; });
  const Rigid3 cam_from_parent =
      keyframe.cam_from_world * keyframes.At(parent).cam_from_world.Inverse();
  // Those that it carried are carried by its parent from now on, so that no chains grow with time.
  std::vector<KeyframeId> carried;
  retired.ForEach([&](KeyframeId child, const RetiredKeyframe& r) {
    if (r.parent == id) carried.push_back(child);
  });
  for (const KeyframeId child : carried)
    retired.MutableAt(child) = {parent, retired.At(child).cam_from_parent * cam_from_parent,
                                retired.At(child).unit};
  retired.Insert(id, {parent, cam_from_parent, keyframe.unit});
  keyframes.Erase(id);
}

void Map::DropFreeKeypoints(KeyframeId id) {
  Keyframe packed = keyframes.At(id);
  const LearnedDescriptors& learned = packed.features->learned;
  std::vector<uint32_t> kept;
  std::vector<float> depths;
  for (uint32_t i = 0, described = 0; i < packed.landmarks.size(); ++i) {
    const bool is_described =
        described < learned.keypoints.size() && learned.keypoints[described] == i;
    const float depth = is_described ? packed.learned_depths[described++] : 0;
    if (!packed.landmarks[i].IsValid() && depth == 0) continue;
    kept.push_back(i);
    if (is_described) depths.push_back(depth);
  }
  if (kept.size() == packed.landmarks.size()) return;
  packed.features = std::make_shared<const Features>(packed.features->Selected(kept));
  packed.learned_depths = std::move(depths);
  const auto keep = [&](auto& by_keypoint) {
    std::remove_reference_t<decltype(by_keypoint)> shown;
    shown.reserve(kept.size());
    for (const uint32_t i : kept) shown.push_back(by_keypoint[i]);
    by_keypoint = std::move(shown);
  };
  keep(packed.landmarks);
  if (!packed.depths.empty()) keep(packed.depths);
  for (uint32_t i = 0; i < packed.landmarks.size(); ++i) {
    if (!packed.landmarks[i].IsValid()) continue;
    auto& observations = landmarks.MutableAt(packed.landmarks[i]).observations;
    std::ranges::lower_bound(observations, id, {}, &Observation::keyframe)->keypoint = i;
  }
  keyframes.MutableAt(id) = std::move(packed);
}

void Map::UpdateLandmarkGeometry(LandmarkId id) {
  Landmark& landmark = landmarks.MutableAt(id);
  if (landmark.observations.empty()) return;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Observation& o : landmark.observations)
    sum +=
        (landmark.position - keyframes.At(o.keyframe).cam_from_world.OriginInSource()).normalized();
  landmark.normal = sum.normalized();
  const Observation& reference = landmark.observations.front();
  const Keyframe& keyframe = keyframes.At(reference.keyframe);
  const PyramidScales& pyramid = keyframe.features->pyramid;
  const double distance =
      (landmark.position - keyframe.cam_from_world.OriginInSource()).norm() / pyramid.zoom;
  const double scale = pyramid.Relative(keyframe.features->keypoints[reference.keypoint].octave);
  landmark.max_distance = static_cast<float>(distance * scale);
  landmark.min_distance =
      landmark.max_distance / static_cast<float>(pyramid.Relative(pyramid.levels - 1));
}

void Map::UpdateLandmark(LandmarkId id) {
  UpdateLandmarkGeometry(id);
  Landmark& landmark = landmarks.MutableAt(id);
  // All pairs are compared: this bounds them to 144, whatever the number of observations is. The
  // latest are those that look most like the next.
  constexpr size_t kMaxCompared = 12;
  std::vector<const Descriptor*> all;
  const size_t n = landmark.observations.size();
  for (size_t i = n > kMaxCompared ? n - kMaxCompared : 0; i < n; ++i) {
    const Observation& o = landmark.observations[i];
    all.push_back(&keyframes.At(o.keyframe).features->descriptors[o.keypoint]);
  }
  if (all.empty()) return;
  int best_median = std::numeric_limits<int>::max();
  std::vector<int> distances(all.size());
  for (const Descriptor* candidate : all) {
    std::ranges::transform(all, distances.begin(),
                           [&](const Descriptor* d) { return HammingDistance(*candidate, *d); });
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) / 2);
    std::ranges::nth_element(distances, middle);
    if (*middle < best_median) {
      best_median = *middle;
      landmark.descriptor = *candidate;
    }
  }
}

namespace {

bool MoreCovisible(const Covisible& a, const Covisible& b) {
  return a.shared != b.shared ? a.shared > b.shared : a.keyframe < b.keyframe;
}

}  // namespace

void Map::UpdateCovisibility(KeyframeId id, int min_shared) {
  std::map<KeyframeId, int> shared;
  for (const LandmarkId landmark : keyframes.At(id).landmarks)
    if (landmark.IsValid())
      for (const Observation& o : landmarks.At(landmark).observations)
        if (o.keyframe != id) ++shared[o.keyframe];
  Covisible strongest;
  for (const auto& [other, count] : shared)
    if (count > strongest.shared) strongest = {other, count};
  std::vector<Covisible> edges;
  for (const auto& [other, count] : shared)
    if (count >= min_shared || other == strongest.keyframe) edges.push_back({other, count});

  for (const Covisible& old : keyframes.At(id).covisible)
    if (std::ranges::find(edges, old.keyframe, &Covisible::keyframe) == edges.end())
      std::erase_if(keyframes.MutableAt(old.keyframe).covisible,
                    [&](const Covisible& c) { return c.keyframe == id; });
  for (const Covisible& edge : edges) {
    auto& back = keyframes.MutableAt(edge.keyframe).covisible;
    std::erase_if(back, [&](const Covisible& c) { return c.keyframe == id; });
    const Covisible entry{id, edge.shared};
    back.insert(std::ranges::upper_bound(back, entry, MoreCovisible), entry);
  }
  std::ranges::sort(edges, MoreCovisible);
  keyframes.MutableAt(id).covisible = std::move(edges);
}

std::vector<KeyframeId> Map::CovisibleKeyframes(KeyframeId id, int count) const {
  std::vector<KeyframeId> result;
  if (const Keyframe* keyframe = keyframes.Find(id))
    for (const Covisible& c : keyframe->covisible) {
      if (static_cast<int>(result.size()) >= count) break;
      result.push_back(c.keyframe);
    }
  return result;
}

std::vector<KeyframeId> Map::KeyframesAround(KeyframeId id, int count) const {
  std::vector<KeyframeId> around = CovisibleKeyframes(id, count);
  around.push_back(id);
  return around;
}

KeyframeId Map::NearestKeyframe(const Eigen::Vector3d& place) const {
  KeyframeId nearest;
  double least = std::numeric_limits<double>::infinity();
  keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    const double distance = (keyframe.cam_from_world.OriginInSource() - place).norm();
    if (distance < least) least = distance, nearest = id;
  });
  return nearest;
}

int Map::CountTrackedLandmarks(KeyframeId id, int min_observations) const {
  int count = 0;
  for (const LandmarkId landmark : keyframes.At(id).landmarks)
    if (landmark.IsValid() &&
        static_cast<int>(landmarks.At(landmark).observations.size()) >= min_observations)
      ++count;
  return count;
}

int Map::CountMappedObjects() const {
  int count = 0;
  objects.ForEach(
      [&](ObjectId, const Object& object) { count += object.state == ObjectState::kMapped; });
  return count;
}

double Map::MedianDepth(const Rigid3& cam_from_world, std::span<const LandmarkId> ids) const {
  std::vector<double> depths;
  for (const LandmarkId id : ids)
    if (const Landmark* landmark = id.IsValid() ? landmarks.Find(id) : nullptr)
      depths.push_back((cam_from_world * landmark->position).z());
  return depths.empty() ? 0 : Median(std::move(depths));
}

double Map::MedianDepth(KeyframeId id) const {
  const Keyframe& keyframe = keyframes.At(id);
  return MedianDepth(keyframe.cam_from_world, keyframe.landmarks);
}

void Map::Scale(double factor) {
  OASLAM_CHECK(factor > 0);
  for (const KeyframeId id : keyframes.Ids()) {
    Keyframe& keyframe = keyframes.MutableAt(id);
    keyframe.cam_from_world.translation *= factor;
    keyframe.ScaleLengths(factor);
  }
  for (const KeyframeId id : retired.Ids())
    retired.MutableAt(id).cam_from_parent.translation *= factor;
  for (const LandmarkId id : landmarks.Ids()) {
    Landmark& landmark = landmarks.MutableAt(id);
    landmark.position *= factor;
    landmark.min_distance *= static_cast<float>(factor);
    landmark.max_distance *= static_cast<float>(factor);
  }
  for (const ObjectId id : objects.Ids()) {
    Object& object = objects.MutableAt(id);
    object.ellipsoid.center *= factor;
    object.ellipsoid.half_axes *= factor;
    object.covariance.topRows<3>() *= factor;
    object.covariance.leftCols<3>() *= factor;
    for (ObjectObservation& o : object.observations) o.ScaleLengths(factor);
  }
  for (auto& [name, anchor] : anchors) anchor.Scale(factor);
}

}  // namespace oaslam
