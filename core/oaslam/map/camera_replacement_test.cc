#include "oaslam/map/camera_replacement.h"

#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/geometry/camera_model.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

Camera Distorting() {
  Camera c{.width = 640, .height = 480, .fx = 480, .fy = 480, .cx = 315, .cy = 248};
  c.distortion = {-0.2, 0.05, 0.001, 0, 0};
  return c;
}

synthetic::MappedWorld SmallMap() {
  synthetic::MappedWorld world =
      synthetic::MakeMap(synthetic::MakeWorld({.points = 100, .cameras = 3}), {});
  Object object;
  object.observations = {{0, KeyframeId(0), {}, 0, Box{100, 50, 300, 260}, 0.9, 0},
                         {10, KeyframeId(1), {}, 1, Box{100, 50, 300, 260}, 0.9, 0}};
  world.map.objects.Insert(ObjectId(0), object);
  world.map.cameras.push_back(Distorting());
  return world;
}

TEST(CameraReplacement, KeyPointsKeepTheirOriginalPixel) {
  const Map map = SmallMap().map;
  const Map changed = WithCamera(map, 0, Distorting());
  EXPECT_EQ(changed.cameras[0], Distorting());
  EXPECT_THAT(changed.CheckInvariants(), IsEmpty());
  const Features& before = *map.keyframes.At(KeyframeId(1)).features;
  const Features& after = *changed.keyframes.At(KeyframeId(1)).features;
  ASSERT_EQ(after.size(), before.size());
  const Box bounds = IdealImageBounds(Distorting());
  EXPECT_EQ(after.bounds, bounds);
  for (int i = 0; i < after.size(); ++i) {
    const Eigen::Vector2d raw = Distort(Distorting(), after.keypoints[i].px.cast<double>());
    EXPECT_LT((raw - before.keypoints[i].px.cast<double>()).norm(), 1e-3);
    bool found = false;
    after.VisitNear(after.keypoints[i].px.cast<double>(), 1,
                    [&](int j) { found = found || i == j; });
    EXPECT_TRUE(found);
  }
}

TEST(CameraReplacement, BoxesGoAlong) {
  const Map changed = WithCamera(SmallMap().map, 0, Distorting());
  const auto& observations = changed.objects.At(ObjectId(0)).observations;
  EXPECT_EQ(observations[0].box, UndistortBox(Distorting(), {100, 50, 300, 260}));
  EXPECT_EQ(observations[1].box, (Box{100, 50, 300, 260}));  // of another camera
}

TEST(CameraReplacement, AnotherZoomOfTheLensIsReplacedInProportion) {
  Map map = SmallMap().map;
  const Camera zoomed = Zoomed(map.cameras[0], 1.5);
  map.cameras.push_back(zoomed);
  map.keyframes.MutableAt(KeyframeId(2)).camera = 2;
  const Map changed = WithCamera(map, 0, Distorting());
  EXPECT_EQ(changed.cameras[1], Distorting());  // had another centre, so that it is another lens
  EXPECT_EQ(changed.cameras[2], Zoomed(Distorting(), 1.5));
  const Features& before = *map.keyframes.At(KeyframeId(2)).features;
  const Features& after = *changed.keyframes.At(KeyframeId(2)).features;
  for (int i = 0; i < after.size(); ++i)
    EXPECT_LT((Distort(changed.cameras[2], after.keypoints[i].px.cast<double>()) -
               before.keypoints[i].px.cast<double>())
                  .norm(),
              1e-3);
  EXPECT_EQ(ZoomBetween(map.cameras[0], zoomed), 1.5);
  EXPECT_FALSE(ZoomBetween(map.cameras[0], Distorting()));
}

TEST(CameraReplacement, ThereAndBackIsNoChange) {
  const Map map = SmallMap().map;
  const Map back = WithCamera(WithCamera(map, 0, Distorting()), 0, map.cameras[0]);
  const Features& before = *map.keyframes.At(KeyframeId(2)).features;
  const Features& after = *back.keyframes.At(KeyframeId(2)).features;
  for (int i = 0; i < after.size(); ++i)
    EXPECT_LT((after.keypoints[i].px - before.keypoints[i].px).norm(), 1e-3);
  const Box box = back.objects.At(ObjectId(0)).observations[0].box;
  EXPECT_NEAR(box.x1, 100, 1e-3);
  EXPECT_NEAR(box.y2, 260, 1e-3);
}

}  // namespace
}  // namespace oaslam
