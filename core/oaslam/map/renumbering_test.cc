#include "oaslam/map/renumbering.h"

#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/map/joining.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

// A map with one of everything that has a number.
Submap EverythingOnce() {
  Submap submap{synthetic::MakeMap(synthetic::MakeWorld({.points = 200}), {}).map, {}};
  Map& map = submap.map;
  Object cup;
  cup.category_id = 41;
  cup.state = ObjectState::kMapped;
  cup.last_seen_frame = 20;
  cup.observations.emplace_back();
  cup.observations[0].frame_index = 20;
  cup.observations[0].reference = KeyframeId(2);
  cup.landmarks = {LandmarkId(3)};
  cup.landmark_votes = {5};
  map.objects.Insert(ObjectId(4), cup);
  map.merged_objects.Insert(ObjectId(6), ObjectId(4));
  map.anchors["on the cup"] = {.model = "flag",
                               .size = 0.1,
                               .keyframe = KeyframeId(1),
                               .cam_from_anchor = {},
                               .object = ObjectId(4)};
  map.anchors["free"] = {
      .model = "tree", .size = 0.1, .keyframe = KeyframeId(0), .cam_from_anchor = {}, .object = {}};
  map.RetireKeyframe(KeyframeId(3));
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
    submap.trajectory.push_back({k.frame_index, k.timestamp, id, {}});
  });
  return submap;
}

Renumbering Behind(const Map& map) {
  Camera other = map.cameras[0];
  other.fx = 600;
  return {NextIdsOf(map), 1000, {other, map.cameras[0]}, {1}};
}

TEST(Renumbering, ShiftsEveryNumberAndNothingElse) {
  const Submap old = EverythingOnce();
  const Renumbering numbers = Behind(old.map);
  const Submap submap = Renumbered(old, numbers);
  const Map& map = submap.map;
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  ASSERT_EQ(map.keyframes.size(), old.map.keyframes.size());
  ASSERT_EQ(map.landmarks.size(), old.map.landmarks.size());
  const KeyframeId second(2 + numbers.first.keyframe);
  EXPECT_EQ(map.keyframes.At(second).frame_index, 1020);
  EXPECT_EQ(map.keyframes.At(second).camera, 1);
  EXPECT_EQ(map.keyframes.At(second).cam_from_world.translation,
            old.map.keyframes.At(KeyframeId(2)).cam_from_world.translation);
  EXPECT_EQ(map.ResolvePose(KeyframeId(3 + numbers.first.keyframe))->translation,
            old.map.ResolvePose(KeyframeId(3))->translation);
  const ObjectId cup_id(4 + numbers.first.object);
  const Object& cup = map.objects.At(cup_id);
  EXPECT_EQ(cup.observations[0].frame_index, 1020);
  EXPECT_EQ(cup.observations[0].reference, second);
  EXPECT_EQ(cup.landmarks[0], LandmarkId(3 + numbers.first.landmark));
  EXPECT_EQ(cup.last_seen_frame, 1020);
  EXPECT_EQ(map.ResolveObject(ObjectId(6 + numbers.first.object)), cup_id);
  EXPECT_EQ(map.anchors.at("on the cup").object, cup_id);
  EXPECT_FALSE(map.anchors.at("free").object.IsValid());
  EXPECT_EQ(submap.trajectory[2].frame_index, 1020);
  EXPECT_EQ(submap.trajectory[2].reference, second);
}

TEST(Renumbering, AMapCanBeJoinedWithItsCopy) {
  const Submap old = EverythingOnce();
  const Renumbering numbers = Behind(old.map);
  Map map = old.map;
  map.cameras = numbers.cameras;
  for (const KeyframeId id : map.keyframes.Ids()) map.keyframes.MutableAt(id).camera = 1;
  JoinMap(Renumbered(old, numbers).map, Similarity(), map);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_EQ(map.keyframes.size(), 2 * old.map.keyframes.size());
  EXPECT_EQ(map.objects.size(), 2U);
  EXPECT_TRUE(map.anchors.contains("free (2)"));
}

}  // namespace
}  // namespace oaslam
