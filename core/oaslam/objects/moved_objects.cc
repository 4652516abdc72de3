#include "oaslam/objects/moved_objects.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/objects/description.h"
#include "oaslam/objects/life_cycle.h"
#include "oaslam/objects/object_model.h"
#include "oaslam/objects/presence.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Logarithm of the ratio of two sizes: a factor of 1.6, as sizes from few views are off.
constexpr double kSameSize = 0.5;
// Observations in another place needed to move an object, converted to a video of 30 Hz; fewer than
// for a new object, since its class and size are known.
constexpr double kMinNewer = 12;
constexpr int kNewestShares[] = {
    2, 3};  // first tries the newest half of its observations, then the newest third

double LogSize(const Object& object) { return std::log(object.ellipsoid.half_axes.prod()) / 3; }

// The sum of weights of the observations from `begin` on; 0 if they are too few
// to determine a place.
double WeightFrom(const Object& object, size_t begin) {
  constexpr size_t kFew = 4;  // images; fewer do not see it from two sides
  if (object.observations.size() < begin + kFew) return 0;
  double weight = 0;
  for (size_t i = begin; i < object.observations.size(); ++i)
    weight += object.observations[i].weight;
  return weight;
}

// The object fitted to its observations from `begin` on; nothing if they do not agree on a model.
std::optional<Object> FromNewer(const Map& map, ObjectId id, size_t begin,
                                const ObjectsConfig& config) {
  Object object = map.objects.At(id);
  object.was_mapped |= object.state == ObjectState::kMapped;
  object.observations.erase(object.observations.begin(),
                            object.observations.begin() + static_cast<std::ptrdiff_t>(begin));
  object.evidence = WeightFrom(object, 0);
  object.total_observations = static_cast<int>(object.observations.size());
  const std::vector<BoxView> views = ViewsOf(map, object.observations);
  const auto model = FitObjectModel(map, views, nullptr, config);
  if (!model || !IsConfirmed(model->overlap, config)) return std::nullopt;
  AdoptModel(*model, views, object);
  object.landmarks.clear();
  object.landmark_votes.clear();
  object.known_by_landmarks = false;
  object.state =
      object.evidence >= config.min_observations ? ObjectState::kMapped : ObjectState::kInitialized;
  object.absence = 0;
  object.misses = 0;
  object.has_moved |= object.was_mapped;
  return object;
}

void Move(ObjectId id, Object moved, Map& map) {
  const double distance = (moved.ellipsoid.center - map.objects.At(id).ellipsoid.center).norm();
  Log(moved.has_moved ? LogLevel::kInfo : LogLevel::kDebug,
      fmt::format("{} has moved by {:.3g}: {} detections since frame {} show it there",
                  NameForLog(id, moved), distance, moved.total_observations,
                  moved.observations.front().frame_index));
  map.objects.MutableAt(id) = std::move(moved);
}

// Index of the first observation after the last one that shows the object in its place.
size_t FirstElsewhere(const Map& map, const Object& object) {
  const std::vector<BoxView> views = ViewsOf(map, object.observations);
  size_t first = views.size();
  while (first > 0) {
    const BoxView& view = views[first - 1];
    const auto projection = ProjectToBox(object.ellipsoid, view.cam_from_world, *view.camera);
    if (projection &&
        IoU(ClipAtTruncation(*projection, view.box, view.truncated), view.box) >= kMinAcceptIoU)
      break;
    --first;
  }
  return first;
}

// Whether `other` may be the same object in another place: its labels agree, and it was first
// detected after `object` was last detected.
bool MaySucceed(const Object& object, const Object& other) {
  return MayBeTheSame(LabelsOf(other), LabelsOf(object)) && !other.observations.empty() &&
         other.observations.front().frame_index > object.last_seen_frame;
}

// The mapped object that an absent object has become, or whether an unmapped object may still
// become it.
struct Succession {
  ObjectId successor;
  bool is_pending = false;
};

Succession FindSuccessor(const Map& map, ObjectId id, const ImageTime& now) {
  const Object& object = map.objects.At(id);
  Succession found;
  double least = kSameSize;
  map.objects.ForEach([&](ObjectId other_id, const Object& other) {
    if (other_id == id || IsProvenAbsent(other.absence) || !MaySucceed(object, other)) return;
    if (other.state != ObjectState::kMapped) {
      found.is_pending |= !IsForgotten(UnseenSince(other, now));
      return;
    }
    const double difference = std::abs(LogSize(object) - LogSize(other));
    if (difference >= least) return;
    least = difference;
    found.successor = other_id;
  });
  return found;
}

void Succeed(ObjectId id, ObjectId successor, Map& map) {
  Object moved = map.objects.At(successor);
  moved.name = map.objects.At(id).name;
  moved.has_moved = true;
  Move(id, std::move(moved), map);
  map.objects.Erase(successor);
  map.merged_objects.Insert(successor, id);
}

}  // namespace

void SetClassRelations(ClassRelations classes, Map& map) {
  map.classes = std::move(classes);
  for (const ObjectId id : map.objects.Ids()) {
    const Object& object = map.objects.At(id);
    if (!map.classes.IsMovable(object.category_id)) continue;
    Log(LogLevel::kInfo, NameForLog(id, object) + " removed: its class moves");
    map.objects.Erase(id);
  }
}

bool RefitFromNewer(ObjectId id, const ObjectsConfig& config, Map& map) {
  const size_t count = map.objects.At(id).observations.size();
  for (const int share : kNewestShares) {
    if (WeightFrom(map.objects.At(id), count - count / share) < kMinNewer) return false;
    if (auto moved = FromNewer(map, id, count - count / share, config)) {
      Move(id, std::move(*moved), map);
      return true;
    }
  }
  return false;
}

void ResolveAbsent(const ImageTime& now, const ObjectsConfig& config, Map& map) {
  for (const ObjectId id : map.objects.Ids()) {
    const Object* object = map.objects.Find(id);
    if (!object || !IsProvenAbsent(object->absence)) continue;
    const size_t elsewhere = FirstElsewhere(map, *object);
    const bool is_seen_elsewhere = WeightFrom(*object, elsewhere) >= kMinNewer;
    if (is_seen_elsewhere)
      if (auto moved = FromNewer(map, id, elsewhere, config)) {
        Move(id, std::move(*moved), map);
        continue;
      }
    const Succession succession = FindSuccessor(map, id, now);
    if (succession.successor.IsValid()) {
      Succeed(id, succession.successor, map);
    } else if (succession.is_pending ||
               (is_seen_elsewhere && !IsForgotten(UnseenSince(*object, now)))) {
      if (object->state == ObjectState::kMapped) {
        Log(LogLevel::kInfo, "{} is no longer in its place: not used until it is found again",
            NameForLog(id, *object));
        map.objects.MutableAt(id).state = ObjectState::kInitialized;
      }
    } else {
      Log(LogLevel::kInfo, "{} removed: not in its place any more, last seen in frame {}",
          NameForLog(id, *object), object->last_seen_frame);
      map.objects.Erase(id);
    }
  }
}

}  // namespace oaslam
