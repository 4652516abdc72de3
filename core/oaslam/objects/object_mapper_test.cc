#include "oaslam/objects/object_mapper.h"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "oaslam/objects/known_poses.h"
#include "object_table.h"

namespace oaslam {
namespace {

using namespace object_table;

TEST(ObjectMapping, FindsWhatIsOnTheTableAndNothingElse) {
  const auto objects = TableTop();
  for (const ObjectMethod model : {ObjectMethod::kRobust, ObjectMethod::kPaper}) {
    ObjectsConfig config;
    config.model = model;
    const KnownPoseMap result =
        MapObjectsFromKnownPoses(Film(objects, 150, {}, 1), kCamera, config);
    const std::vector<Object> mapped = MappedObjects(result.map);
    EXPECT_EQ(mapped.size(), objects.size()) << static_cast<int>(model);
    for (const TrueObject& truth : objects)
      EXPECT_LT(DistanceToNearest(truth, mapped), 0.02) << static_cast<int>(model);
    EXPECT_GT(result.mean_iou, 0.85) << static_cast<int>(model);
    for (const Object& o : mapped) {
      EXPECT_LE(o.observations.size(), 60U);
      EXPECT_GT(o.total_observations, 100);
      EXPECT_GT(o.detection_rate, 0.8);
      EXPECT_LT(o.detection_rate, 0.97);
      EXPECT_GT(o.covariance.diagonal().minCoeff(), 0);
      EXPECT_LT(std::sqrt(o.covariance.topLeftCorner<3, 3>().trace()), 0.05);
    }
    EXPECT_TRUE(result.map.CheckInvariants().empty());
  }
}

TEST(ObjectMapping, ASightingOfAClassThatIsNowMovableMakesNoObject) {
  Map map;
  map.classes.movable = {1};
  ObjectSighting sighting;
  sighting.object = ObjectId(0);
  sighting.category_id = 1;
  sighting.is_new = true;
  UpdateObjects(map, std::span(&sighting, 1), {}, {});
  EXPECT_TRUE(map.objects.empty());
}

TEST(ObjectMapping, IsTheSameOnEveryRun) {
  const auto film = Film(TableTop(), 80, {}, 2);
  const KnownPoseMap a = MapObjectsFromKnownPoses(film, kCamera, {}),
                     b = MapObjectsFromKnownPoses(film, kCamera, {});
  ASSERT_FALSE(a.map.objects.empty());
  ASSERT_EQ(a.map.objects.Ids(), b.map.objects.Ids());
  for (const ObjectId id : a.map.objects.Ids())
    EXPECT_EQ(a.map.objects.At(id).ellipsoid.center, b.map.objects.At(id).ellipsoid.center);
}

TEST(ObjectMapping, ScaleOfTheMapDoesNotMatter) {
  auto film = Film(TableTop(), 120, {}, 3);
  const auto near = MappedObjects(MapObjectsFromKnownPoses(film, kCamera, {}).map);
  for (PosedDetections& frame : film) frame.cam_from_world.translation *= 50;
  const auto far = MappedObjects(MapObjectsFromKnownPoses(film, kCamera, {}).map);
  ASSERT_EQ(near.size(), TableTop().size());
  ASSERT_EQ(near.size(), far.size());
  for (size_t i = 0; i < near.size(); ++i) {
    EXPECT_LT((far[i].ellipsoid.center - 50 * near[i].ellipsoid.center).norm(), 0.01 * 50);
    EXPECT_LT((far[i].ellipsoid.half_axes - 50 * near[i].ellipsoid.half_axes).norm(), 0.01 * 50);
  }
}

TEST(ObjectMapping, SlowVideoNeedsNoMoreTime) {
  // Five seconds of video: each image of a slower video counts more.
  const auto film = Film(TableTop(), 150, {}, 8);
  for (const size_t step : {1, 3, 6, 15}) {
    std::vector<PosedDetections> slow;
    for (size_t i = 0; i < film.size(); i += step) {
      slow.push_back(film[i]);
      slow.back().frame_index = static_cast<int>(i / step);
    }
    const auto mapped = MappedObjects(MapObjectsFromKnownPoses(slow, kCamera, {}).map);
    EXPECT_EQ(mapped.size(), TableTop().size()) << step;
    for (const TrueObject& truth : TableTop())
      EXPECT_LT(DistanceToNearest(truth, mapped), 0.02) << step;
  }
}

TEST(ObjectMapping, FastVideoNeedsNoLessTime) {
  // At 120 Hz 20 detections are a sixth of a second.
  auto film = Film(TableTop(), 150, {}, 8);
  const auto mapped_after = [&](size_t count) {
    return MappedObjects(MapObjectsFromKnownPoses(std::span(film).first(count), kCamera, {}).map)
        .size();
  };
  EXPECT_EQ(mapped_after(60), TableTop().size());
  for (PosedDetections& frame : film) frame.timestamp /= 4;
  EXPECT_EQ(mapped_after(60), 0U);
}

TEST(ObjectMapping, SizeAndOrientationOfTheImageDoNotMatter) {
  const auto film = Film(TableTop(), 120, {.box_px = 3, .miss_rate = 0.1, .false_rate = 0.1}, 9);
  const auto known = MapObjectsFromKnownPoses(film, kCamera, {});
  const auto expected = MappedObjects(known.map);
  ASSERT_EQ(expected.size(), TableTop().size());
  for (const double scale : {0.25, 6.0})
    for (const bool is_turned : {false, true}) {
      Camera camera = kCamera;
      camera.width = static_cast<int>(scale * kCamera.width);
      camera.height = static_cast<int>(scale * kCamera.height);
      camera.fx = camera.fy = scale * kCamera.fx;
      camera.cx = scale * (kCamera.cx + 0.5) - 0.5;
      camera.cy = scale * (kCamera.cy + 0.5) - 0.5;
      // The world is turned by 90 degrees: what was left is now above.
      if (is_turned) {
        std::swap(camera.width, camera.height);
        camera.cx = camera.width - 1 - (scale * (kCamera.cy + 0.5) - 0.5);
        camera.cy = scale * (kCamera.cx + 0.5) - 0.5;
      }
      auto other = film;
      for (PosedDetections& frame : other) {
        const Rigid3 turn(Eigen::Quaterniond(Eigen::AngleAxisd(is_turned ? M_PI / 2 : 0,
                                                               Eigen::Vector3d::UnitZ())),
                          {0, 0, 0});
        frame.cam_from_world = turn * frame.cam_from_world;
        for (ObjectDetection& d : frame.detections) {
          d.box = {scale * d.box.x1, scale * d.box.y1, scale * d.box.x2, scale * d.box.y2};
          if (is_turned)
            d.box = {camera.width - d.box.y2, d.box.x1, camera.width - d.box.y1, d.box.x2};
        }
      }
      const auto mapped = MappedObjects(MapObjectsFromKnownPoses(other, camera, {}).map);
      ASSERT_EQ(mapped.size(), expected.size()) << scale << is_turned;
      // The turned map has no vertical, so that the shapes have more freedom.
      for (size_t i = 0; i < mapped.size(); ++i) {
        EXPECT_LT((mapped[i].ellipsoid.center - expected[i].ellipsoid.center).norm(),
                  is_turned ? 0.01 : 1e-4)
            << scale << is_turned;
        EXPECT_NEAR(mapped[i].covariance(0, 0) / expected[i].covariance(0, 0), 1,
                    is_turned ? 0.5 : 1e-3)
            << scale << is_turned;
      }
    }
}

TEST(ObjectMapping, OnlyBriefSightingsAreDropped) {
  auto film = Film(TableTop(), 200, {}, 4);
  for (int i = 10; i < 25; ++i)
    film[i].detections.push_back({0, 0.9, {100.0 + i, 100, 160.0 + i, 220}, 0});
  const KnownPoseMap result = MapObjectsFromKnownPoses(film, kCamera, {});
  EXPECT_EQ(MappedObjects(result.map).size(), TableTop().size());
  result.map.objects.ForEach([&](ObjectId, const Object& o) { EXPECT_NE(o.category_id, 0); });
}

TEST(ObjectMapping, FollowsCorrectedKeyframes) {
  const auto film = Film(TableTop(), 120, {}, 5);
  Map map = MapObjectsFromKnownPoses(film, kCamera, {}).map;
  const Rigid3 moved_from_world(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
      {3, -2, 1});
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    keyframe.cam_from_world = keyframe.cam_from_world * moved_from_world.Inverse();
  }
  const auto before = MappedObjects(map);
  UpdateObjects(map, {}, {120, 4}, {});
  const auto after = MappedObjects(map);
  ASSERT_EQ(before.size(), TableTop().size());
  ASSERT_EQ(before.size(), after.size());
  for (size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((after[i].ellipsoid.center - moved_from_world * before[i].ellipsoid.center).norm(),
              0.01);
}

}  // namespace
}  // namespace oaslam
