#include "oaslam/mapping/loop_undoing.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/joining.h"
#include "oaslam/map/landmark_sets.h"
#include "oaslam/matching/point_observation.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

using Carrier = LaterPoses::Carrier;

// Takes the keyframes and landmarks that were added since into the map as it was.
class PointsUndoing {
 public:
  PointsUndoing(const Map& bent, const ClosedLoop& loop, UndoneLoop& result)
      : bent_(bent), before_(*loop.before), map_(result.map), result_(result) {
    const double scale = MotionToEarlier(bent, before_, loop.current).scale;
    result_.later.carriers.push_back(
        {loop.frame_index, loop.current, *bent.ResolvePose(loop.current), scale});
  }

  void Run(int min_shared_landmarks) {
    for (const KeyframeId id : bent_.keyframes.Ids())
      if (!before_.keyframes.Contains(id) && !before_.retired.Contains(id)) AddKeyframe(id);
    for (const LandmarkId id : added_) AddOlderObservations(id);
    for (const LandmarkId id : added_)
      if (map_.landmarks.At(id).observations.size() < 2) map_.EraseLandmark(id);
    for (const LandmarkId id : touched_)
      if (map_.landmarks.Contains(id)) map_.UpdateLandmark(id);
    for (size_t i = 1; i < carriers().size(); ++i)
      map_.UpdateCovisibility(carriers()[i].id, min_shared_landmarks);
    AddRetired();
  }

 private:
  const std::vector<Carrier>& carriers() const { return result_.later.carriers; }

  // What a landmark of the bent map was before: of two that were merged the one seen by the newest
  // keyframe, since the camera is at that end. Nothing for a new landmark.
  std::optional<LandmarkId> Before(LandmarkId id) const {
    const std::vector<Observation>& all = bent_.landmarks.At(id).observations;
    for (auto o = all.rbegin(); o != all.rend(); ++o) {
      const Keyframe* was = before_.keyframes.Find(o->keyframe);
      if (!was || was->features != bent_.keyframes.At(o->keyframe).features) continue;
      const LandmarkId landmark = was->landmarks[o->keypoint];
      if (landmark.IsValid()) return landmark;
    }
    if (before_.landmarks.Contains(id)) return id;
    return std::nullopt;
  }

  // The keyframe from which a later one follows: the one before it, unless the camera was lost in
  // between and found itself elsewhere.
  Carrier Predecessor(KeyframeId id) const {
    const std::vector<Covisible>& covisible = bent_.keyframes.At(id).covisible;
    const auto sees = [&](KeyframeId other) {
      return std::ranges::find(covisible, other, &Covisible::keyframe) != covisible.end();
    };
    const Carrier& last = carriers().back();
    if (carriers().size() == 1 || sees(last.id) || !bent_.keyframes.Contains(last.id)) return last;
    for (const Covisible& c : covisible) {
      const auto later = std::ranges::find(carriers(), c.keyframe, &Carrier::id);
      if (later != carriers().end()) return *later;
      if (before_.keyframes.Contains(c.keyframe))
        return {0, c.keyframe, bent_.keyframes.At(c.keyframe).cam_from_world,
                MotionToEarlier(bent_, before_, c.keyframe).scale};
    }
    return last;
  }

  void AddKeyframe(KeyframeId id) {
    constexpr int kFewest = 20;  // landmarks that refine a pose
    const Keyframe& bent = bent_.keyframes.At(id);
    const Carrier from = Predecessor(id);
    Rigid3 motion = bent.cam_from_world * from.cam_from_world.Inverse();
    motion.translation *= from.scale;
    Keyframe keyframe = bent;
    keyframe.cam_from_world = motion * *map_.ResolvePose(from.id);
    keyframe.landmarks.assign(bent.landmarks.size(), LandmarkId());
    keyframe.covisible.clear();

    std::vector<PointObservation> points;
    std::vector<std::pair<LandmarkId, uint32_t>> shown;
    for (uint32_t i = 0; i < bent.landmarks.size(); ++i) {
      if (!bent.landmarks[i].IsValid()) continue;
      const LandmarkId known = Before(bent.landmarks[i]).value_or(bent.landmarks[i]);
      const Landmark* landmark = map_.landmarks.Find(known);
      if (!landmark) continue;
      points.push_back(ObservationOf(*bent.features, static_cast<int>(i), *landmark));
      shown.emplace_back(known, i);
      if (known != bent.landmarks[i]) result_.landmarks[bent.landmarks[i]] = known;
    }
    const PoseReport refined =
        RefinePose(map_.cameras[bent.camera], keyframe.cam_from_world, points);
    const bool is_refined = refined.success && refined.inliers >= kFewest;
    if (is_refined) keyframe.cam_from_world = refined.cam_from_world;
    const Rigid3 world_from_cam = keyframe.cam_from_world.Inverse();
    map_.keyframes.Insert(id, std::move(keyframe));
    for (size_t i = 0; is_refined && i < shown.size(); ++i)
      if (refined.inlier[i] && map_.AddObservation(shown[i].first, id, shown[i].second))
        touched_.insert(shown[i].first);
    for (uint32_t i = 0; i < bent.landmarks.size(); ++i) {
      const LandmarkId landmark = bent.landmarks[i];
      if (!landmark.IsValid() || Before(landmark) || map_.landmarks.Contains(landmark)) continue;
      Landmark fresh = bent_.landmarks.At(landmark);
      fresh.position = world_from_cam * (from.scale * (bent.cam_from_world * fresh.position));
      fresh.observations.clear();
      map_.landmarks.Insert(landmark, std::move(fresh));
      map_.AddObservation(landmark, id, i);
      added_.push_back(landmark);
      touched_.insert(landmark);
    }
    result_.later.carriers.push_back({bent.frame_index, id, bent.cam_from_world, from.scale});
  }

  // Observations of a new landmark by keyframes of before are kept where they show it still.
  void AddOlderObservations(LandmarkId id) {
    const Landmark landmark = map_.landmarks.At(id);
    for (const Observation& o : bent_.landmarks.At(id).observations) {
      const Keyframe* was = before_.keyframes.Find(o.keyframe);
      if (!was || was->features != bent_.keyframes.At(o.keyframe).features) continue;
      const Eigen::Vector3d in_cam = was->cam_from_world * landmark.position;
      if (in_cam.z() <= 0) continue;
      const PointObservation seen =
          ObservationOf(*was->features, static_cast<int>(o.keypoint), landmark);
      if ((ProjectIdeal(map_.cameras[was->camera], in_cam) - seen.px).squaredNorm() *
              seen.inverse_variance <
          kChi2TwoDof)
        map_.AddObservation(id, o.keyframe, o.keypoint);
    }
  }

  // Keyframes that were made and culled since.
  void AddRetired() {
    bent_.retired.ForEach([&](KeyframeId id, const RetiredKeyframe&) {
      if (map_.keyframes.Contains(id) || map_.retired.Contains(id)) return;
      const auto after = std::ranges::upper_bound(carriers(), id, {}, &Carrier::id);
      const Carrier& by = after == carriers().begin() ? carriers().front() : *std::prev(after);
      Rigid3 cam_from_parent = *bent_.ResolvePose(id) * by.cam_from_world.Inverse();
      cam_from_parent.translation *= by.scale;
      map_.retired.Insert(id, {by.id, cam_from_parent});
    });
  }

  const Map &bent_, &before_;
  Map& map_;
  UndoneLoop& result_;
  std::vector<LandmarkId> added_;
  std::set<LandmarkId> touched_;
};

// How well the ellipsoid explains the boxes: their mean overlap.
double MeanOverlap(const Map& map, const Ellipsoid& ellipsoid,
                   const std::vector<ObjectObservation>& observations) {
  double sum = 0;
  for (const ObjectObservation& o : observations)
    if (const auto reference = map.ResolvePose(o.reference))
      if (const auto box =
              ProjectToBox(ellipsoid, o.cam_from_reference * *reference, map.cameras[o.camera]))
        sum += IoU(*box, o.box);
  return sum / static_cast<double>(observations.size());
}

// The similarity that takes points about a carrier from the bent map to the restored one.
Similarity MotionOf(const Carrier& carrier, const Map& map) {
  return Similarity(map.ResolvePose(carrier.id)->Inverse()) *
         Similarity(carrier.scale, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()) *
         Similarity(carrier.cam_from_world);
}

void AddNewObject(ObjectId id, Object object, const LaterPoses& later, Map& map) {
  const ObjectObservation& middle = object.observations[object.observations.size() / 2];
  MoveObject(MotionOf(later.CarrierOf(middle.frame_index), map), object);
  map.objects.Insert(id, std::move(object));
}

void UndoObjects(const Map& before, const LaterPoses& later, Map& map) {
  constexpr double kLeastOverlap = 0.1;
  const Map& bent = *later.bent;
  // What each object of the bent map was before: of several the one that explains the later boxes.
  std::map<ObjectId, std::vector<ObjectId>> origins;
  before.objects.ForEach([&](ObjectId id, const Object&) {
    if (const auto now = bent.ResolveObject(id)) origins[*now].push_back(id);
  });
  bent.objects.ForEach([&](ObjectId id, Object now) {
    std::erase_if(now.observations, [&](const ObjectObservation& o) {
      return o.frame_index <= later.carriers.front().frame_index;
    });
    if (now.observations.empty()) return;
    for (ObjectObservation& o : now.observations)
      later.Restore(o.frame_index, o.reference, o.cam_from_reference);
    const auto known = origins.find(id);
    if (known == origins.end()) return AddNewObject(id, std::move(now), later, map);
    ObjectId best;
    double most = kLeastOverlap;
    for (const ObjectId origin : known->second) {
      const Object& object = map.objects.At(origin);
      const double overlap = object.state == ObjectState::kTentative
                                 ? kLeastOverlap
                                 : MeanOverlap(map, object.ellipsoid, now.observations);
      if (overlap >= most) {
        best = origin;
        most = overlap;
      }
    }
    if (!best.IsValid()) return;
    Object& object = map.objects.MutableAt(best);
    object.name = now.name;
    object.total_observations += static_cast<int>(now.observations.size());
    for (const ObjectObservation& o : now.observations) object.evidence += o.weight;
    object.last_seen_frame = now.last_seen_frame;
    object.last_seen_time = now.last_seen_time;
    object.observations.insert(object.observations.end(), now.observations.begin(),
                               now.observations.end());
  });
  bent.merged_objects.ForEach([&](ObjectId gone, ObjectId into) {
    if (!map.objects.Contains(gone) && !map.merged_objects.Contains(gone))
      map.merged_objects.Insert(gone, into);
  });
}

// Content keeps its place on what it stands on: what was placed before is where it was.
void UndoAnchors(const Map& before, const LaterPoses& later, Map& map) {
  map.anchors = later.bent->anchors;
  for (auto& [name, anchor] : map.anchors) {
    const auto known = before.anchors.find(name);
    const auto carrier = std::ranges::find(later.carriers, anchor.keyframe, &Carrier::id);
    if (known != before.anchors.end() && known->second.keyframe == anchor.keyframe)
      anchor = known->second;
    else if (carrier != later.carriers.end())
      anchor.Scale(carrier->scale);
  }
}

}  // namespace

UndoneLoop UndoLoop(std::shared_ptr<const Map> bent, int min_shared_landmarks) {
  OASLAM_CHECK(bent->refuted_loop != nullptr);
  const ClosedLoop& loop = *bent->refuted_loop;
  UndoneLoop result{*loop.before, {bent, {}}, {}};
  Map& map = result.map;
  map.version = bent->version;
  map.next_landmark = bent->next_landmark;
  map.classes = bent->classes;
  map.undone_loops = bent->undone_loops;
  map.undone_loops.emplace_back(loop.current, loop.old);
  PointsUndoing(*bent, loop, result).Run(min_shared_landmarks);
  UndoObjects(*loop.before, result.later, map);
  for (const ObjectId id : map.objects.Ids()) ForgetErasedLandmarks(map, map.objects.MutableAt(id));
  UndoAnchors(*loop.before, result.later, map);
  return result;
}

}  // namespace oaslam
