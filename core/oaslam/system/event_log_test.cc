#include "oaslam/system/event_log.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "matchers.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/util/rng.h"
#include "random_map.h"

namespace oaslam {
namespace {

// The states of a Slam whose map has one anchor, of size 1, which stands on an object.
class EventLogTest : public testing::Test {
 protected:
  EventLogTest() {
    Rng rng(3);
    map_ = RandomMap({}, rng).map;
    map_.is_metric = false;
    object_ = map_.objects.Ids().front();
    map_.objects.MutableAt(object_).state = ObjectState::kMapped;
    Anchor flag;
    flag.size = 1;
    flag.keyframe = keyframe_ = map_.keyframes.Ids().front();
    flag.object = object_;
    map_.anchors = {{"flag", flag}};
    EventsAfter([](Map&) {}, {}, WorldId(1));
  }

  // The new events after a change of the map: their kinds, with the anchors' names.
  std::vector<std::string> EventsAfter(const std::function<void(Map&)>& change,
                                       const ChangesBetweenStates& changes = {},
                                       WorldId world = {}) {
    const SlamState before = now_;
    change(map_);
    if (world.IsValid()) now_.result.world = world;
    now_.result.timestamp = 0.5 * ++now_.result.frame;
    now_.map = SnapshotOf({map_, {}, CocoClassNames()}, now_.result.world, 1);
    const uint64_t seen = newest_.number;
    log_.Add(before, now_, changes);
    std::vector<std::string> events;
    for (const SlamEvent& event : log_.After(seen)) {
      events.push_back(ToString(event.kind) + std::string(event.anchor.empty() ? "" : " ") +
                       event.anchor);
      newest_ = event;
    }
    return events;
  }

  std::vector<std::string> EventsOfMotion(double distance, const ChangesBetweenStates& changes = {},
                                          WorldId world = {}) {
    return EventsAfter(
        [&](Map& map) { map.objects.MutableAt(object_).ellipsoid.center.x() += distance; }, changes,
        world);
  }

  EventLog log_;
  SlamEvent newest_;
  SlamState now_;
  Map map_;
  KeyframeId keyframe_;
  ObjectId object_;
};

TEST_F(EventLogTest, TellsOfLoopsAndSubmaps) {
  const auto close_loop = [](Map& map) { ++map.loops_closed; };
  EXPECT_THAT(EventsAfter([](Map& map) { ++map.version; }), IsEmpty());
  EXPECT_THAT(EventsAfter(close_loop), ElementsAre("loop closed"));
  EXPECT_EQ(newest_.frame, now_.result.frame);
  EXPECT_EQ(newest_.timestamp, now_.result.timestamp);
  EXPECT_FALSE(newest_.submap.IsValid());
  EXPECT_THAT(EventsAfter([](Map&) {}, {.begun = {WorldId(8)}}), ElementsAre("submap began"));
  EXPECT_EQ(newest_.submap, WorldId(8));
  // A submap that was joined has loops of its own.
  EXPECT_THAT(EventsAfter(close_loop, {.joined = {WorldId(8)}}), ElementsAre("submap joined"));
  EXPECT_EQ(newest_.submap, WorldId(8));
  EXPECT_EQ(newest_.world, WorldId(1));
  // Another map has other loops.
  EXPECT_THAT(EventsAfter(close_loop, {}, WorldId(8)), ElementsAre("world"));
}

TEST_F(EventLogTest, TellsOfTheMetreOnce) {
  const auto scale = [](Map& map) { map.is_metric = true; };
  EXPECT_THAT(EventsAfter(scale, {}, WorldId(2)), ElementsAre("world", "metric"));
  EXPECT_THAT(EventsAfter(scale, {}, WorldId(3)), ElementsAre("world"));
}

// Small corrections add up; each event begins the count again.
TEST_F(EventLogTest, TellsOfAnAnchorThatMovedVisibly) {
  EXPECT_THAT(EventsOfMotion(0.06), IsEmpty());
  EXPECT_THAT(EventsOfMotion(0.06), ElementsAre("anchor moved flag"));
  EXPECT_THAT(EventsOfMotion(0.06), IsEmpty());
  const auto turn = [&](Map& map) {
    Rigid3& pose = map.keyframes.MutableAt(keyframe_).cam_from_world;
    pose.rotation = pose.rotation * Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX());
  };
  EXPECT_THAT(EventsAfter(turn), ElementsAre("anchor moved flag"));
  EXPECT_THAT(EventsOfMotion(3, {.edited_anchor = "flag"}), ElementsAre("anchor edited flag"));
  EXPECT_THAT(EventsOfMotion(0.06), IsEmpty());
  // Positions in two worlds cannot be compared.
  EXPECT_THAT(EventsOfMotion(3, {}, WorldId(4)), ElementsAre("world"));
  EXPECT_THAT(EventsOfMotion(0.06), IsEmpty());
}

TEST_F(EventLogTest, TellsOfAnAnchorWhoseObjectIsGone) {
  const auto merge = [&](Map& map) {
    const ObjectId other = map.objects.Ids().back();
    map.objects.MutableAt(other).ellipsoid = map.objects.At(object_).ellipsoid;
    map.objects.MutableAt(other).state = ObjectState::kMapped;
    map.merged_objects.Insert(object_, other);
    map.objects.Erase(std::exchange(object_, other));
  };
  EXPECT_THAT(EventsAfter(merge), IsEmpty());  // the anchor stands on the other one
  EXPECT_THAT(EventsAfter([&](Map& map) { map.objects.Erase(object_); }),
              testing::Contains("anchor lost flag"));
  EXPECT_THAT(EventsAfter([](Map& map) { ++map.version; }), IsEmpty());
}

// Whoever looks too seldom sees by the numbers that he has missed some.
TEST_F(EventLogTest, KeepsTheNewestThousand) {
  for (uint32_t i = 0; i < 1200; ++i) EventsAfter([](Map&) {}, {}, WorldId(10 + i % 2));
  const std::vector<SlamEvent> events = log_.After(1);
  ASSERT_THAT(events, SizeIs(1000));
  EXPECT_EQ(events.back().number, newest_.number);
  EXPECT_EQ(events.front().number, newest_.number - 999);
}

}  // namespace
}  // namespace oaslam
