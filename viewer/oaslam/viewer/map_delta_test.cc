#include "oaslam/viewer/map_delta.h"

#include <map>

#include "matchers.h"
#include "message_reader.h"
#include "oaslam/viewer/path.h"
#include "random_map.h"

namespace oaslam {
namespace {

using nlohmann::json;

// The state of a page after a sequence of messages.
struct Page {
  json anchors = json::array();
  std::map<uint32_t, Eigen::Vector3f> landmarks;
  std::map<uint32_t, std::vector<uint32_t>> keyframes;  // edges
  std::map<uint32_t, json> objects;
  size_t changed_landmarks = 0;  // of the last message

  void Take(const Map* before, const Map& now) {
    MessageBuilder builder("update");
    AddMapDelta(before, now, {{41, "cup"}}, builder);
    const DecodedMessage message(std::move(builder).Finish());
    const auto ids = message.Array<uint32_t>("landmark_ids");
    const auto xyz = message.Array<float>("landmark_positions");
    changed_landmarks = ids.size();
    for (size_t i = 0; i < ids.size(); ++i)
      landmarks[ids[i]] = {xyz[3 * i], xyz[3 * i + 1], xyz[3 * i + 2]};
    for (const uint32_t id : message.Array<uint32_t>("landmarks_gone"))
      EXPECT_EQ(landmarks.erase(id), 1U);
    const auto degrees = message.Array<uint32_t>("keyframe_degrees"),
               edges = message.Array<uint32_t>("keyframe_edges");
    const auto keyframe_ids = message.Array<uint32_t>("keyframe_ids");
    auto edge = edges.begin();
    for (size_t i = 0; i < keyframe_ids.size(); edge += 2 * degrees[i++])
      keyframes[keyframe_ids[i]] = {edge, edge + 2 * degrees[i]};
    for (const uint32_t id : message.Array<uint32_t>("keyframes_gone"))
      EXPECT_EQ(keyframes.erase(id), 1U);
    for (const json& object : message.header.value("objects", json::array()))
      objects[object["id"].get<uint32_t>()] = object;
    if (message.header.contains("anchors")) anchors = message.header["anchors"];
    for (const json& id : message.header.value("objects_gone", json::array()))
      EXPECT_EQ(objects.erase(id.get<uint32_t>()), 1U);
  }

  void ExpectShows(const Map& map) const {
    EXPECT_EQ(landmarks.size(), map.landmarks.size());
    map.landmarks.ForEach([&](LandmarkId id, const Landmark& l) {
      EXPECT_EQ(landmarks.at(id.value), l.position.cast<float>());
    });
    EXPECT_EQ(keyframes.size(), map.keyframes.size());
    map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
      EXPECT_EQ(keyframes.at(id.value).size(), 2 * k.covisible.size());
    });
    size_t shown = 0;
    map.objects.ForEach([&](ObjectId id, const Object& o) {
      if (o.state == ObjectState::kTentative) return;
      ++shown;
      EXPECT_EQ(objects.at(id.value)["observations"], o.total_observations);
    });
    EXPECT_EQ(objects.size(), shown);
  }
};

TEST(MapDelta, FromNothingIsTheWholeMap) {
  Rng rng(1);
  const Map map = RandomMap({.objects = 12}, rng).map;
  Page page;
  page.Take(nullptr, map);
  page.ExpectShows(map);
}

TEST(MapDelta, ManySmallEditsLeadToTheSameMap) {
  Rng rng(2);
  Map map =
      RandomMap({.keyframes = 20, .keypoints = 200, .landmarks = 900, .objects = 12}, rng).map;
  auto snapshot = std::make_shared<const Map>(map);
  Page page;
  page.Take(nullptr, *snapshot);
  for (int step = 0; step < 40; ++step) {
    const std::vector<LandmarkId> ids = map.landmarks.Ids();
    for (int i = 0; i < 5; ++i)
      map.landmarks.MutableAt(ids[static_cast<size_t>(rng.Index(static_cast<int>(ids.size())))])
          .position.x() += 0.5;
    map.EraseLandmark(ids[static_cast<size_t>(rng.Index(static_cast<int>(ids.size())))]);
    if (step % 10 == 0) map.RetireKeyframe(map.keyframes.Ids()[static_cast<size_t>(rng.Index(5))]);
    if (step % 7 == 0) map.objects.Erase(map.objects.Ids().front());
    if (step % 3 == 0 && !map.objects.empty())
      map.objects.MutableAt(map.objects.Ids().back()).total_observations += 1;
    const auto next = std::make_shared<const Map>(map);
    page.Take(snapshot.get(), *next);
    page.ExpectShows(*next);
    snapshot = next;
  }
}

TEST(MapDelta, AnchorsAreToldWhenTheyChange) {
  Rng rng(5);
  Map map = RandomMap({}, rng).map;
  Page page;
  page.Take(nullptr, map);
  EXPECT_THAT(page.anchors, IsEmpty());
  const auto empty = std::make_shared<const Map>(map);
  map.anchors["gate"] = {"flag",   0.5, map.keyframes.Ids().front(), {}, map.objects.Ids().back(),
                         {0, 1, 0}};
  map.objects.MutableAt(map.objects.Ids().back()).state = ObjectState::kMapped;
  page.Take(empty.get(), map);
  ASSERT_EQ(page.anchors.size(), 1U);
  EXPECT_EQ(page.anchors[0]["name"], "gate");
  EXPECT_EQ(page.anchors[0]["object"], map.objects.Ids().back().value);
  const json before = page.anchors;
  const auto placed = std::make_shared<const Map>(map);
  map.objects.MutableAt(map.objects.Ids().back()).ellipsoid.center.x() += 1;
  page.Take(placed.get(), map);
  EXPECT_NEAR(page.anchors[0]["pose"][4].get<double>(), before[0]["pose"][4].get<double>() + 1,
              1e-4);
  const auto moved = std::make_shared<const Map>(map);
  map.anchors.clear();
  page.Take(moved.get(), map);
  EXPECT_THAT(page.anchors, IsEmpty());
}

// The cost follows the size of the change and not that of the map, which keeps maps of 50 k
// landmarks fast.
TEST(MapDelta, HoldsOnlyWhatChanged) {
  Rng rng(3);
  Map map;
  map.cameras.push_back({.width = 640, .height = 480, .fx = 500, .fy = 500, .cx = 320, .cy = 240});
  for (int i = 0; i < 50000; ++i)
    map.AddLandmark({rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1)}, KeyframeId(0));
  const auto before = std::make_shared<const Map>(map);
  map.landmarks.MutableAt(LandmarkId(777)).position.y() += 1;
  map.landmarks.MutableAt(LandmarkId(40000)).found += 1;  // a change that is not shown
  map.AddLandmark({0, 0, 1}, KeyframeId(0));
  Page page;
  page.Take(before.get(), map);
  EXPECT_EQ(page.changed_landmarks, 2U);
  EXPECT_THAT(page.landmarks, testing::Contains(testing::Key(777U)));
  MessageBuilder same("update");
  AddMapDelta(before.get(), *before, {}, same);
  EXPECT_FALSE(same.header.contains("map"));
}

TEST(Path, MovesWithItsKeyframes) {
  Rng rng(4);
  Map map = RandomMap({}, rng).map;
  const std::vector<KeyframeId> ids = map.keyframes.Ids();
  Path path;
  path.Add({0, 0, ids[0], {}, TrackingState::kTracking}, map);
  path.Add({1, 0.1, ids[1], {}, TrackingState::kTracking}, map);
  path.Add({2, 0.2, KeyframeId(5000), {}, TrackingState::kTracking},
           map);  // relative to a keyframe that does not exist yet
  const auto delta = [&](uint64_t version) {
    MessageBuilder builder("update");
    path.AddDelta(version, builder);
    return DecodedMessage(std::move(builder).Finish());
  };
  EXPECT_THAT(delta(0).Array<uint32_t>("path_places"), ElementsAre(0, 1));
  EXPECT_EQ(delta(0).header["path_size"], 3);
  uint64_t known = path.version();
  map.keyframes.MutableAt(ids[1]).cam_from_world.translation.x() += 1;
  path.Update(map);
  EXPECT_THAT(delta(known).Array<uint32_t>("path_places"), ElementsAre(1));
  const Eigen::Vector3d now = map.keyframes.At(ids[1]).cam_from_world.OriginInSource();
  EXPECT_NEAR(delta(known).Array<float>("path_poses")[4], now.x(), 1e-5);
  known = path.version();
  Keyframe late = map.keyframes.At(ids[0]);
  map.keyframes.Insert(KeyframeId(5000), late);
  path.Update(map);
  EXPECT_THAT(delta(known).Array<uint32_t>("path_places"), ElementsAre(2));
  known = path.version();
  path.Clear();
  EXPECT_EQ(delta(known).header["path_size"], 0);
  EXPECT_THAT(delta(known).Array<uint32_t>("path_places"), IsEmpty());
}

TEST(Message, ArraysAreAlignedAndForeignBytesDoNotEndTheProgram) {
  MessageBuilder builder("x");
  builder.header["name"] = "a\xff b";
  const std::vector<uint8_t> odd{1, 2, 3};
  const std::vector<float> floats{0.5F, -1};
  builder.Add("odd", odd);
  builder.Add("none", std::vector<float>{});
  builder.Add("floats", floats);
  const DecodedMessage message(std::move(builder).Finish());
  EXPECT_EQ(message.Array<uint8_t>("odd"), odd);
  EXPECT_EQ(message.Array<float>("floats"), floats);
  EXPECT_THAT(message.Array<float>("none"), IsEmpty());
  EXPECT_EQ(message.header["type"], "x");
}

}  // namespace
}  // namespace oaslam
