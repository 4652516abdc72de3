#include "oaslam/mapping/loop_undoing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/joining.h"
#include "oaslam/mapping/local_mapping.h"
#include "oaslam/mapping/loop_closing.h"
#include "object_film.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

using testing::IsEmpty;

constexpr uint32_t kBefore = 30, kLater = 6;
constexpr KeyframeId kOld(2), kCurrent(kBefore - 1);
constexpr ObjectId kOldThing(0), kCurrentThing(1), kNewThing(2);

double DistanceBetween(const Rigid3& a, const Rigid3& b) {
  return (a.OriginInSource() - b.OriginInSource()).norm();
}

// A camera goes along an arc. A wrong loop takes keyframe 29 to be near keyframe 2 and smaller than
// it is; then the camera goes on, and sees old and new landmarks.
struct Bent {
  synthetic::World world;
  std::shared_ptr<const Map> before, after;  // `after`: bent, with what came later
  double scale = 0.8;
  Rigid3 later_pose;  // of a frame after the last keyframe, true

  Bent() {
    world = synthetic::MakeWorld({.cameras = kBefore + kLater + 1, .arc_deg = 150});
    later_pose = world.cam_from_world.back();
    world.cam_from_world.pop_back();
    synthetic::World first = world;
    first.cam_from_world.resize(kBefore);
    synthetic::MappedWorld mapped = synthetic::MakeMap(first, {});
    CutByThirds(mapped.map);
    AddThing(kOldThing, {-0.3, 0.2, 0}, 0, 10, mapped.map);
    AddThing(kCurrentThing, {0.4, 0.1, 0.1}, 20, kBefore, mapped.map);
    before = std::make_shared<const Map>(mapped.map);

    Map map = mapped.map;
    const LoopClosure loop = FalseLoop(map);
    EXPECT_TRUE(CorrectLoop(loop, 15, map));
    GoOn(map);
    MergeThings(map);
    map.refuted_loop = std::make_shared<const ClosedLoop>(ClosedLoop{
        kCurrent, kOld, loop.old_from_current, before->keyframes.At(kCurrent).frame_index, before});
    after = std::make_shared<const Map>(map);
  }

  // Each landmark becomes one for each third of the way, so that the ends share none.
  static void CutByThirds(Map& map) {
    for (const LandmarkId id : map.landmarks.Ids()) {
      const Landmark whole = map.landmarks.At(id);
      map.EraseLandmark(id);
      for (uint32_t third = 0; third < 3; ++third) {
        const LandmarkId part = map.AddLandmark(whole.position, KeyframeId(third * kBefore / 3));
        for (const Observation& o : whole.observations)
          if (o.keyframe.value * 3 / kBefore == third)
            map.AddObservation(part, o.keyframe, o.keypoint);
        if (map.landmarks.At(part).observations.size() < 2)
          map.EraseLandmark(part);
        else
          map.UpdateLandmark(part);
      }
    }
    // Neighbouring thirds see the same.
    for (uint32_t k = 0; k < kBefore; ++k) map.UpdateCovisibility(KeyframeId(k), 15);
  }

  void AddThing(ObjectId id, const Eigen::Vector3d& center, uint32_t from, uint32_t to,
                Map& map) const {
    Object object;
    object.category_id = 5;
    object.state = ObjectState::kMapped;
    object.ellipsoid = synthetic::Upright(5, center, {0.2, 0.15, 0.1}).ellipsoid;
    for (uint32_t k = from; k < to; ++k) object.observations.push_back(See(map, object, k));
    map.objects.Insert(id, object);
  }

  static ObjectObservation See(const Map& map, const Object& object, uint32_t k) {
    const Keyframe& keyframe = map.keyframes.At(KeyframeId(k));
    return {
        keyframe.frame_index,
        KeyframeId(k),
        {},
        0,
        ProjectToBox(object.ellipsoid, keyframe.cam_from_world, map.cameras[0]).value_or(Box{})};
  }

  LoopClosure FalseLoop(const Map& map) const {
    LoopClosure loop{kCurrent, kOld, {}, {}};
    loop.old_from_current = {
        scale, Eigen::Quaterniond(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ())), {-1, 0.8, 0}};
    const Keyframe &here = map.keyframes.At(kCurrent), &there = map.keyframes.At(kOld);
    for (uint32_t i = 0, j = 0; i < here.landmarks.size() && j < there.landmarks.size(); ++i, ++j)
      if (here.landmarks[i].IsValid() && there.landmarks[j].IsValid())
        loop.old_landmarks.emplace_back(i, there.landmarks[j]);
    return loop;
  }

  // Later keyframes: their poses in the bent map are those of a camera that has gone on from the
  // one that closed the loop.
  void GoOn(Map& map) const {
    const Keyframe& current = map.keyframes.At(kCurrent);
    const Rigid3 bent_pose = current.cam_from_world;
    Rng rng(9);
    std::map<int, LandmarkId> shown;  // by point: what the current keyframe shows
    Rng same(2);
    for (uint32_t k = 0; k < kBefore; ++k) {
      const synthetic::View view =
          synthetic::MakeView(world, world.cam_from_world[k], {}, same);  // as MakeMap made it
      if (k + 1 == kBefore)
        for (uint32_t i = 0; i < view.point_of_keypoint.size(); ++i)
          if (view.point_of_keypoint[i] >= 0 && current.landmarks[i].IsValid())
            shown[view.point_of_keypoint[i]] = current.landmarks[i];
    }
    for (uint32_t k = kBefore; k < kBefore + kLater; ++k) {
      const synthetic::View view = synthetic::MakeView(world, world.cam_from_world[k], {}, rng);
      KeyframeInsertion insertion{KeyframeId(k), {}};
      TrackedFrame& tracked = insertion.frame;
      tracked.frame.index = static_cast<int>(10 * k);
      tracked.frame.timestamp = k;
      tracked.frame.features = view.features;
      Rigid3 motion = world.cam_from_world[k] * world.cam_from_world[kBefore - 1].Inverse();
      motion.translation *= scale;
      // The tracker's reference may be at the wrong end of the loop.
      tracked.reference = kOld;
      tracked.cam_from_world = motion * bent_pose;
      tracked.cam_from_reference =
          tracked.cam_from_world * map.keyframes.At(kOld).cam_from_world.Inverse();
      // Half of the points are found again; the others become new landmarks.
      for (const int point : view.point_of_keypoint) {
        const auto known = shown.find(point);
        tracked.landmarks.push_back(point % 2 == 0 && known != shown.end() ? known->second
                                                                           : LandmarkId());
      }
      InsertKeyframe(insertion, {}, map);
      TriangulateNewLandmarks(insertion.id, {}, map);
      map.UpdateCovisibility(insertion.id, 15);
    }
  }

  // The thing about the current end was merged into that of the old end; both were seen since, and
  // one that is new.
  void MergeThings(Map& map) const {
    Object taken = map.objects.At(kCurrentThing);
    Object& kept = map.objects.MutableAt(kOldThing);
    for (const ObjectObservation& o : taken.observations) kept.observations.push_back(o);
    std::ranges::stable_sort(kept.observations, {}, &ObjectObservation::frame_index);
    Object fresh = taken;
    fresh.observations.clear();
    for (uint32_t k = kBefore; k < kBefore + kLater; ++k) {
      kept.observations.push_back(See(map, taken, k));
      fresh.observations.push_back(See(map, fresh, k));
    }
    map.objects.Erase(kCurrentThing);
    map.merged_objects.Insert(kCurrentThing, kOldThing);
    map.objects.Insert(kNewThing, fresh);
  }
};

TEST(LoopUndoing, TheMapIsAsItWasAndGoesOnFromThere) {
  const Bent bent;
  ASSERT_THAT(bent.before->CheckInvariants(), IsEmpty());
  ASSERT_THAT(bent.after->CheckInvariants(), IsEmpty());
  // The loop has bent the map, and merged landmarks.
  ASSERT_GT(DistanceBetween(bent.after->keyframes.At(kCurrent).cam_from_world,
                            bent.world.cam_from_world[kCurrent.value]),
            0.5);
  size_t lost = 0;
  bent.before->landmarks.ForEach(
      [&](LandmarkId id, const Landmark&) { lost += !bent.after->landmarks.Contains(id); });
  ASSERT_GT(lost, 50U);

  const UndoneLoop undone = UndoLoop(bent.after, 15);
  const Map& map = undone.map;
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_FALSE(map.refuted_loop);
  EXPECT_EQ(map.undone_loops, (std::vector{std::pair(kCurrent, kOld)}));
  EXPECT_EQ(map.loops_closed, bent.before->loops_closed);
  EXPECT_EQ(map.next_landmark, bent.after->next_landmark);
  bent.before->keyframes.ForEach([&](KeyframeId id, const Keyframe& was) {
    EXPECT_EQ(map.keyframes.At(id).cam_from_world.translation, was.cam_from_world.translation);
  });
  bent.before->landmarks.ForEach([&](LandmarkId id, const Landmark& was) {
    EXPECT_EQ(map.landmarks.At(id).position, was.position) << id.value;
  });
  for (uint32_t k = kBefore; k < kBefore + kLater; ++k) {
    const Keyframe& later = map.keyframes.At(KeyframeId(k));
    EXPECT_LT(DistanceBetween(later.cam_from_world, bent.world.cam_from_world[k]), 0.01) << k;
    EXPECT_LT(later.cam_from_world.rotation.angularDistance(bent.world.cam_from_world[k].rotation),
              0.005);
    EXPECT_GT(map.CountTrackedLandmarks(KeyframeId(k), 2), 150) << k;
  }
  // Landmarks made since are true to scale.
  size_t fresh = 0;
  std::vector<double> errors;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    if (id.value < bent.before->next_landmark) return;
    ++fresh;
    const std::vector<Descriptor>& known = bent.world.descriptors;
    const auto point = std::ranges::min_element(
        known, {}, [&](const Descriptor& d) { return HammingDistance(d, landmark.descriptor); });
    errors.push_back((bent.world.points[point - known.begin()] - landmark.position).norm());
  });
  ASSERT_GT(fresh, 50U);
  std::ranges::sort(errors);
  EXPECT_LT(errors[errors.size() / 2], 0.1);  // at a distance of 3
}

TEST(LoopUndoing, LaterPosesNoLongerReferToTheWrongEnd) {
  const Bent bent;
  const UndoneLoop undone = UndoLoop(bent.after, 15);
  const int frame = static_cast<int>(10 * (kBefore + kLater)) - 3;
  // A frame after the last keyframe, whose pose the tracker knows relative to the old end.
  const KeyframeId newest(kBefore + kLater - 1);
  Rigid3 motion = bent.later_pose * bent.world.cam_from_world.back().Inverse();
  motion.translation *= bent.scale;
  KeyframeId reference = kOld;
  Rigid3 cam_from_reference = motion * bent.after->keyframes.At(newest).cam_from_world *
                              bent.after->keyframes.At(kOld).cam_from_world.Inverse();
  undone.later.Restore(frame, reference, cam_from_reference);
  EXPECT_EQ(reference, newest);
  EXPECT_LT(
      DistanceBetween(cam_from_reference * *undone.map.ResolvePose(reference), bent.later_pose),
      0.02);
  // Frames of before are left alone.
  reference = kOld;
  const Rigid3 known = cam_from_reference;
  undone.later.Restore(bent.after->refuted_loop->frame_index, reference, cam_from_reference);
  EXPECT_EQ(reference, kOld);
  EXPECT_EQ(cam_from_reference.translation, known.translation);
}

TEST(LoopUndoing, ThingsAreTwoAgainAndKeepWhatWasSeenSince) {
  const Bent bent;
  const Map map = UndoLoop(bent.after, 15).map;
  const Object &old_thing = map.objects.At(kOldThing), &thing = map.objects.At(kCurrentThing);
  EXPECT_FALSE(map.merged_objects.Contains(kCurrentThing));
  EXPECT_EQ(old_thing.observations.size(), 10U);
  EXPECT_EQ(thing.observations.size(), kBefore - 20 + kLater);
  // The loop had moved it by the correction of one of its keyframes only.
  for (const ObjectObservation& o : thing.observations) {
    const auto box = ProjectToBox(
        thing.ellipsoid, o.cam_from_reference * *map.ResolvePose(o.reference), map.cameras[0]);
    ASSERT_TRUE(box);
    EXPECT_GT(IoU(*box, o.box), 0.85) << o.frame_index;
  }
  const Object& fresh = map.objects.At(kNewThing);
  EXPECT_EQ(fresh.observations.size(), kLater);
  EXPECT_LT((fresh.ellipsoid.center - thing.ellipsoid.center).norm(), 0.1);
  EXPECT_NEAR(fresh.ellipsoid.half_axes.x(), thing.ellipsoid.half_axes.x(), 0.01);
}

TEST(LoopUndoing, TheSameLoopIsNotClosedAgain) {
  const synthetic::WorldOptions options{.cameras = 18};
  synthetic::World world = synthetic::MakeWorld(options);
  for (uint32_t k = 0; k < 18; ++k) world.cam_from_world.push_back(world.cam_from_world[17 - k]);
  Map map = synthetic::MakeMap(world, {}).map;
  for (const LandmarkId id : map.landmarks.Ids()) {
    std::vector<Observation> back;
    for (const Observation& o : map.landmarks.At(id).observations)
      if (o.keyframe.value >= 18) back.push_back(o);
    for (const Observation& o : back) map.EraseObservation(id, o.keyframe);
    if (back.size() < 2 || !map.landmarks.Contains(id)) continue;
    const LandmarkId twin = map.AddLandmark(map.landmarks.At(id).position, back.front().keyframe);
    for (const Observation& o : back) map.AddObservation(twin, o.keyframe, o.keypoint);
    map.UpdateLandmark(twin);
  }
  for (const KeyframeId id : map.keyframes.Ids()) map.UpdateCovisibility(id, 15);
  Rng rng(1);
  const auto loop = LoopDetector().Detect(map, KeyframeId(35), rng);
  ASSERT_TRUE(loop);
  map.undone_loops.emplace_back(loop->current, loop->old);
  EXPECT_FALSE(LoopDetector().Detect(map, KeyframeId(35), rng));
  EXPECT_FALSE(LoopDetector().Detect(map, KeyframeId(34), rng));
}

}  // namespace
}  // namespace oaslam
