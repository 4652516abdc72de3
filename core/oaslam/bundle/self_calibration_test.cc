#include "oaslam/bundle/self_calibration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "matchers.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/camera_replacement.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

Camera Guess(const Camera& camera, double factor) {
  Camera guess{.width = camera.width,
               .height = camera.height,
               .fx = factor * camera.fx,
               .fy = factor * camera.fy,
               .cx = 0.5 * (camera.width - 1),
               .cy = 0.5 * (camera.height - 1)};
  guess.is_guess = true;
  return guess;
}

// A map made from images with a wrong camera: bent to fit the guess.
Map MapByGuess(const synthetic::World& world, const Camera& lens, double factor,
               synthetic::MapOptions options = {}) {
  options.view.noise_px = 0.4;
  Map map = synthetic::MakeMap(world, options).map;
  // The world's images are ideal: they are distorted by the true lens, and then treated as images
  // of the guess, which has no distortion.
  for (const KeyframeId id : map.keyframes.Ids()) {
    Features raw = *map.keyframes.At(id).features;
    for (Keypoint& k : raw.keypoints) k.px = Distort(lens, k.px.cast<double>()).cast<float>();
    raw.BuildGrid();
    map.keyframes.MutableAt(id).features = std::make_shared<const Features>(raw);
  }
  map.cameras[0] = Guess(lens, factor);
  ApplyCorrection(GlobalBundleAdjustment(map, 20, BundleConfig{}), map);
  return map;
}

TEST(SelfCalibration, FindsTheFocalLengthFromAGuess) {
  const synthetic::World world = synthetic::MakeWorld({.points = 400, .cameras = 12});
  for (const double factor : {0.75, 0.9, 1.0, 1.25}) {
    const SelfCalibration found = SelfCalibrate(MapByGuess(world, world.camera, factor), 0);
    ASSERT_TRUE(found.success) << factor << ": " << found.why_not;
    EXPECT_NEAR(found.camera.fx / world.camera.fx, 1, 0.01) << factor;
    EXPECT_EQ(found.camera.fx, found.camera.fy);
    EXPECT_LT(std::abs(found.camera.fx - world.camera.fx), 4 * found.focal_sigma_px) << factor;
    EXPECT_NEAR(found.camera.distortion[0], 0, 0.02) << factor;
  }
}

TEST(SelfCalibration, KeyframesOfAnotherZoomTakePart) {
  const synthetic::World world = synthetic::MakeWorld({.points = 400, .cameras = 12});
  Map map = MapByGuess(world, world.camera, 0.9);
  map.cameras[0].is_guess = false;
  map.cameras.push_back(Zoomed(map.cameras[0], 1.2));
  for (uint32_t id = 6; id < 12; ++id) {  // the same rays, seen by a longer lens
    Keyframe& keyframe = map.keyframes.MutableAt(KeyframeId(id));
    keyframe.camera = 1;
    Features seen = *keyframe.features;
    const Eigen::Vector2f centre(static_cast<float>(map.cameras[0].cx),
                                 static_cast<float>(map.cameras[0].cy));
    for (Keypoint& k : seen.keypoints) k.px = centre + 1.2F * (k.px - centre);
    seen.BuildGrid();
    keyframe.features = std::make_shared<const Features>(seen);
  }
  const SelfCalibration found = SelfCalibrate(map, 0);
  ASSERT_TRUE(found.success) << found.why_not;
  EXPECT_EQ(found.keyframes, 12);
  EXPECT_NEAR(found.camera.fx / world.camera.fx, 1, 0.01);
}

TEST(SelfCalibration, FindsDistortionAndCenter) {
  synthetic::World world = synthetic::MakeWorld({.points = 600, .cameras = 16, .arc_deg = 90});
  world.camera.cx = 326;
  world.camera.cy = 233;
  Camera lens = world.camera;
  lens.distortion = {-0.12, 0.04, 0, 0, 0};
  const SelfCalibration found = SelfCalibrate(MapByGuess(world, lens, 1.2), 0);
  ASSERT_TRUE(found.success) << found.why_not;
  EXPECT_NEAR(found.camera.fx / lens.fx, 1, 0.01);
  EXPECT_NEAR(found.camera.distortion[0], -0.12, 0.02);
  EXPECT_NEAR(found.camera.cx, 326, 4);
  EXPECT_NEAR(found.camera.cy, 233, 4);
}

TEST(SelfCalibration, RecalibratedMapIsConsistent) {
  const synthetic::World world = synthetic::MakeWorld({.points = 400, .cameras = 12});
  const Map bent = MapByGuess(world, world.camera, 1.25);
  const SelfCalibration found = SelfCalibrate(bent, 0);
  ASSERT_TRUE(found.success) << found.why_not;
  const Map map = Recalibrated(bent, 0, found, {});
  EXPECT_EQ(map.cameras[0], found.camera);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  // A second calibration finds nothing to change.
  const SelfCalibration again = SelfCalibrate(map, 0);
  ASSERT_TRUE(again.success) << again.why_not;
  EXPECT_NEAR(again.camera.fx, found.camera.fx, 0.3 * found.focal_sigma_px);
}

TEST(SelfCalibration, RefusesACameraThatOnlyTurns) {
  synthetic::World world = synthetic::MakeWorld({.points = 800, .cameras = 12});
  for (int k = 0; k < 12; ++k)
    world.cam_from_world[k] =
        synthetic::LookAt({0, -3, 0.3}, {-1.1 + 0.2 * k, 0, 0.3 * std::sin(k)});
  for (const double factor : {0.75, 1.0, 1.25}) {
    const SelfCalibration found = SelfCalibrate(MapByGuess(world, world.camera, factor), 0);
    EXPECT_FALSE(found.success) << factor << ' ' << found.camera.fx << " +- "
                                << found.focal_sigma_px;
  }
}

TEST(SelfCalibration, RefusesStraightAheadTowardsAPlane) {
  synthetic::World world = synthetic::MakeWorld({.points = 800, .cameras = 12});
  for (Eigen::Vector3d& p : world.points) p.y() = 0.05 * p.y();
  for (int k = 0; k < 12; ++k) {
    const double y = -4 + 0.15 * k;
    world.cam_from_world[k] = synthetic::LookAt({0, y, 0.2}, {0, y + 1, 0.2});
  }
  const SelfCalibration found = SelfCalibrate(MapByGuess(world, world.camera, 1.25), 0);
  EXPECT_FALSE(found.success) << found.camera.fx << " +- " << found.focal_sigma_px;
  EXPECT_THAT(found.why_not, HasSubstr("without turning"));
}

TEST(SelfCalibration, RefusesMotionWithoutTurning) {
  synthetic::World world = synthetic::MakeWorld({.points = 800, .cameras = 12});
  for (int k = 0; k < 12; ++k)
    world.cam_from_world[k] =
        synthetic::LookAt({-0.8 + 0.12 * k, -3, 0.2}, {-0.8 + 0.12 * k, 0, 0.2});
  const SelfCalibration found = SelfCalibrate(MapByGuess(world, world.camera, 1.1), 0);
  EXPECT_FALSE(found.success) << found.camera.fx << " +- " << found.focal_sigma_px;
  EXPECT_THAT(found.why_not, HasSubstr("without turning"));
}

TEST(SelfCalibration, RefusesTooLittle) {
  const synthetic::World world = synthetic::MakeWorld({.points = 200, .cameras = 3});
  const SelfCalibration found = SelfCalibrate(synthetic::MakeMap(world, {}).map, 0);
  EXPECT_FALSE(found.success);
  EXPECT_THAT(found.why_not, HasSubstr("3 keyframes"));
  EXPECT_EQ(found.camera, world.camera);
}

TEST(SelfCalibration, IsTheSameEachTime) {
  const synthetic::World world = synthetic::MakeWorld({.points = 300, .cameras = 8});
  const Map map = MapByGuess(world, world.camera, 0.9);
  const SelfCalibration first = SelfCalibrate(map, 0), second = SelfCalibrate(map, 0);
  ASSERT_TRUE(first.success && second.success);
  EXPECT_EQ(first.camera, second.camera);
}

}  // namespace
}  // namespace oaslam
