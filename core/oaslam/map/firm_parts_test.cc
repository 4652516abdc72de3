#include "oaslam/map/firm_parts.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

// Keyframes 0 to 4 and 5 to 12, each of which sees 300 landmarks and shares 200 with the next; the
// two parts share `at_the_door`.
Map TwoRooms(int at_the_door) {
  Map map;
  for (uint32_t k = 0; k < 13; ++k) {
    Keyframe keyframe;
    keyframe.frame_index = static_cast<int>(10 * k);
    keyframe.timestamp = k;
    for (uint32_t i = 0; i < 300; ++i) keyframe.landmarks.push_back(LandmarkId(300 * k + i));
    const auto shared = [&](uint32_t first) { return first == 4 ? at_the_door : 200; };
    if (k > 0) keyframe.covisible.push_back({KeyframeId(k - 1), shared(k - 1)});
    if (k < 12) keyframe.covisible.push_back({KeyframeId(k + 1), shared(k)});
    map.keyframes.Insert(KeyframeId(k), std::move(keyframe));
  }
  return map;
}

void Share(int landmarks, KeyframeId one, KeyframeId other, Map& map) {
  map.keyframes.MutableAt(one).covisible.push_back({other, landmarks});
  map.keyframes.MutableAt(other).covisible.push_back({one, landmarks});
}

TEST(FirmParts, ARoomBehindANarrowDoorIsLoose) {
  const Map map = TwoRooms(20), wide = TwoRooms(100);
  FirmParts parts, of_wide;
  for (uint32_t k = 0; k < 13; ++k) {
    EXPECT_EQ(parts.IsLoose(map, KeyframeId(k)), k < 5) << "the part with less keyframes: " << k;
    EXPECT_FALSE(of_wide.IsLoose(wide, KeyframeId(k))) << k;
  }
}

TEST(FirmParts, ALoopTiesIt) {
  Map map = TwoRooms(20);
  FirmParts parts;
  EXPECT_TRUE(parts.IsLoose(map, KeyframeId(2)));
  Share(100, KeyframeId(0), KeyframeId(12), map);
  ++map.loops_closed;
  EXPECT_FALSE(parts.IsLoose(map, KeyframeId(2)));
}

TEST(FirmParts, AMotionInMetresTiesIt) {
  Map map = TwoRooms(20);
  map.keyframes.MutableAt(KeyframeId(5)).motion.emplace().from = KeyframeId(4);
  EXPECT_TRUE(FirmParts().IsLoose(map, KeyframeId(2)));
  map.keyframes.MutableAt(KeyframeId(5)).motion->metres = 1;
  EXPECT_FALSE(FirmParts().IsLoose(map, KeyframeId(2)));
}

// As the tracker sees it: keyframe by keyframe.
TEST(FirmParts, GrowWithTheMap) {
  const Map whole = TwoRooms(20);
  Map map;
  FirmParts parts;
  const auto see = [&](uint32_t k, Covisible before) {
    Keyframe keyframe = whole.keyframes.At(KeyframeId(std::min(k, 12U)));
    keyframe.covisible = {before};
    map.keyframes.Insert(KeyframeId(k), std::move(keyframe));
    return parts.IsLoose(map, KeyframeId(k));
  };
  map.keyframes.Insert(KeyframeId(0), whole.keyframes.At(KeyframeId(0)));
  map.keyframes.MutableAt(KeyframeId(0)).covisible.clear();
  for (uint32_t k = 1; k < 13; ++k)
    EXPECT_EQ(see(k, {KeyframeId(k - 1), k == 5 ? 20 : 200}), k >= 5 && k < 10)
        << "the longer part leads: " << k;
  EXPECT_TRUE(parts.IsLoose(map, KeyframeId(4)));
  EXPECT_FALSE(see(13, {KeyframeId(12), 100}));
  EXPECT_TRUE(see(14, {KeyframeId(4), 100}));
  map.keyframes.MutableAt(KeyframeId(14)).covisible.push_back({KeyframeId(13), 100});
  EXPECT_FALSE(see(15, {KeyframeId(14), 100})) << "its neighbours have come to share more";
  EXPECT_FALSE(parts.IsLoose(map, KeyframeId(4)));
}

// As where a lost camera was found by objects: it saw some of them before.
TEST(FirmParts, ThreeObjectsTieTwoParts) {
  Map map = TwoRooms(20);
  map.retired.Insert(KeyframeId(20), {KeyframeId(1), {}});  // it was culled
  for (uint32_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(FirmParts().IsLoose(map, KeyframeId(2))) << i << " objects";
    Object object;
    object.state = ObjectState::kMapped;
    for (const uint32_t reference : {20U, 9U})
      object.observations.emplace_back().reference = KeyframeId(reference);
    map.objects.Insert(ObjectId(i), std::move(object));
  }
  EXPECT_FALSE(FirmParts().IsLoose(map, KeyframeId(2)));
}

// Keyframes of submaps that were joined do not ascend with time.
TEST(FirmParts, StretchesAreInTheOrderOfTime) {
  Map map = TwoRooms(20);
  for (uint32_t k = 0; k < 13; ++k) map.keyframes.MutableAt(KeyframeId(k)).timestamp = 12 - k;
  const std::vector<LooseStretch> stretches = LooseStretches(map, 0);
  ASSERT_EQ(stretches.size(), 1);
  EXPECT_EQ(stretches[0].from_s, 8);
  EXPECT_EQ(stretches[0].to_s, 12);
}

TEST(FirmParts, StretchesSayWhereTheirLinkIs) {
  const std::vector<LooseStretch> stretches = LooseStretches(TwoRooms(20), 10);
  ASSERT_EQ(stretches.size(), 1);
  EXPECT_EQ(stretches[0].from_s, 1) << "images before are of an earlier recording";
  EXPECT_EQ(stretches[0].to_s, 4);
  EXPECT_EQ(stretches[0].shared, 20);
  EXPECT_EQ(stretches[0].link_s, 4);
  EXPECT_TRUE(LooseStretches(TwoRooms(100), 0).empty());
}

}  // namespace
}  // namespace oaslam
