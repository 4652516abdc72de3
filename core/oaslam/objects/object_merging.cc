#include "oaslam/objects/object_merging.h"

#include <algorithm>
#include <optional>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/objects/description.h"
#include "oaslam/objects/life_cycle.h"
#include "oaslam/objects/object_model.h"
#include "oaslam/objects/occlusion.h"
#include "oaslam/objects/own_landmarks.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Two objects that this many images show in separate boxes are not the same; one or two such images
// may be errors of the detector.
constexpr int kSideBySide = 3;

bool HasEllipsoid(const Object& object) { return object.state != ObjectState::kTentative; }

// The least mean overlap of a model of both that makes them one: two objects side by side reach
// less. Where the ellipsoids only touch, as where each was seen from one side, the model must
// explain the boxes of both nearly as well as their own do. Nothing where they cannot be the same.
std::optional<double> LeastCommonIoU(const Object& a, const Object& b,
                                     const ObjectsConfig& config) {
  constexpr double kOverlapping = 0.5, kTouching = 0.9;
  constexpr double kFusionIoU = 0.2;  // of bounding boxes in space; as in the paper
  if (!MayBeTheSame(LabelsOf(a), LabelsOf(b))) return std::nullopt;
  if (CountShared(VotedLandmarks(a), VotedLandmarks(b)) > kMinSharedPoints) return kOverlapping;
  if (!HasEllipsoid(a) || !HasEllipsoid(b)) return std::nullopt;
  const double iou = IoU(BoundingBox(a.ellipsoid), BoundingBox(b.ellipsoid));
  if (iou > kFusionIoU || Contains(a.ellipsoid, b.ellipsoid.center) ||
      Contains(b.ellipsoid, a.ellipsoid.center))
    return kOverlapping;
  if (!(iou > 0) || config.model == ObjectMethod::kPaper) return std::nullopt;
  return kTouching * std::min(a.mean_iou, b.mean_iou);
}

// The number of images with separate boxes of both. The observations of both
// are ascending by frame.
int CountSideBySide(const Object& a, const Object& b) {
  int count = 0;
  auto j = b.observations.begin();
  for (const ObjectObservation& o : a.observations) {
    while (j != b.observations.end() && j->frame_index < o.frame_index) ++j;
    if (j != b.observations.end() && j->frame_index == o.frame_index)
      count += IoU(o.box, j->box) < 0.5;
  }
  return count;
}

Object Union(const Map& map, const Object& a, const Object& b) {
  Object joint = a;
  joint.observations.insert(joint.observations.end(), b.observations.begin(), b.observations.end());
  std::ranges::stable_sort(joint.observations, {}, &ObjectObservation::frame_index);
  ThinObservations(map, joint.observations);
  joint.shares = MeanShares(LabelsOf(a), std::max(a.total_observations, 1), LabelsOf(b),
                            std::max(b.total_observations, 1));
  joint.category_id = CommonestLabel(LabelsOf(joint));
  joint.total_observations += b.total_observations;
  joint.evidence += b.evidence;
  joint.last_seen_frame = std::max(a.last_seen_frame, b.last_seen_frame);
  joint.last_seen_time = std::max(a.last_seen_time, b.last_seen_time);
  joint.state = std::max({a.state, b.state, ObjectState::kInitialized});
  if (joint.name.empty()) joint.name = b.name;
  AddVotes(b.landmarks, b.landmark_votes, joint);
  joint.known_by_landmarks = false;
  return joint;
}

struct Joint {
  Object object;
  ViewOverlap overlap;
};

// Fits one ellipsoid to the observations of both; nothing if that fails.
std::optional<Joint> Join(const Map& map, std::span<const ObjectPlace> places, ObjectId kept,
                          ObjectId gone, const ObjectsConfig& config) {
  const Object &a = map.objects.At(kept), &b = map.objects.At(gone);
  Joint joint{Union(map, a, b), {}};
  const Object* better = a.evidence >= b.evidence ? &a : &b;
  if (!HasEllipsoid(*better)) better = better == &a ? &b : &a;
  const Ellipsoid* start = HasEllipsoid(*better) ? &better->ellipsoid : nullptr;
  std::vector<BoxView> views = ViewsOf(map, joint.object.observations);
  const ObjectId own[] = {kept, gone};
  if (start && config.model != ObjectMethod::kPaper)
    MarkHiddenEdges(map, places, own, *start, views);
  const auto model = FitObjectModel(map, views, start, config);
  if (!model) return std::nullopt;
  AdoptModel(*model, views, joint.object);
  joint.overlap = model->overlap;
  return joint;
}

void Replace(Object joint, ObjectId kept, ObjectId gone, Map& map) {
  Log(LogLevel::kDebug, "{} takes in object {}: the same thing mapped twice",
      NameForLog(kept, joint), gone.value);
  map.objects.MutableAt(kept) = std::move(joint);
  map.objects.Erase(gone);
  map.merged_objects.Insert(gone, kept);
}

// Whether two objects are near enough to be the same. An ellipsoid that is seen from few sides may
// be off by several of its sizes.
bool AreNear(const ObjectPlace& a, const ObjectPlace& b) {
  constexpr double kSizes = 10;  // wide: excludes pairs only to save time
  return (a.center - b.center).norm() <= kSizes * (a.radius + b.radius);
}

bool IsMapped(const Map& map, ObjectId id) {
  return map.objects.At(id).state == ObjectState::kMapped;
}

void TryMerge(Map& map, std::span<const ObjectPlace> places, ObjectId kept, ObjectId gone,
              const ObjectsConfig& config) {
  const Object &a = map.objects.At(kept), &b = map.objects.At(gone);
  const std::optional<double> least_iou = LeastCommonIoU(a, b, config);
  if (!least_iou || CountSideBySide(a, b) >= kSideBySide) return;
  std::optional<Joint> joint = Join(map, places, kept, gone, config);
  if (joint && IsConfirmed(joint->overlap, config) && joint->overlap.mean_iou >= *least_iou)
    Replace(std::move(joint->object), kept, gone, map);
}

}  // namespace

bool MergeObjects(Map& map, ObjectId kept, ObjectId gone, const ObjectsConfig& config) {
  if (!MayBeTheSame(LabelsOf(map.objects.At(kept)), LabelsOf(map.objects.At(gone)))) return false;
  std::optional<Joint> joint = Join(map, PlacesOf(map.objects), kept, gone, config);
  if (!joint) return false;
  Replace(std::move(joint->object), kept, gone, map);
  return true;
}

void MergeDuplicates(Map& map, const std::set<ObjectId>& changed, const ObjectsConfig& config) {
  const std::vector<ObjectPlace> places = PlacesOf(map.objects);
  for (const ObjectPlace& a : places) {
    if (!changed.contains(a.id)) continue;
    for (const ObjectPlace& b : places) {
      if (!map.objects.Contains(a.id)) break;
      if (b.id == a.id || !AreNear(a, b) || !map.objects.Contains(b.id)) continue;
      const bool keeps_a =
          IsMapped(map, a.id) == IsMapped(map, b.id) ? a.id < b.id : IsMapped(map, a.id);
      TryMerge(map, places, keeps_a ? a.id : b.id, keeps_a ? b.id : a.id, config);
    }
  }
}

}  // namespace oaslam
