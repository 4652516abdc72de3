#include "oaslam/bundle/rolling_shutter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "matchers.h"
#include "oaslam/bundle/self_calibration.h"
#include "oaslam/geometry/camera_model.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr double kReadoutS = 0.03, kFrameS = 1.0 / 30;

// A camera that swings while it goes along its arc, a keyframe a second.
Rigid3 PoseAt(double time) {
  const Rigid3 on_arc = synthetic::PoseOnArc({}, -30 + 6 * time + 4 * std::sin(5 * time));
  const Eigen::Vector3d turn(0.06 * std::sin(7 * time), 0.05 * std::cos(6 * time), 0);
  return Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm(), turn.normalized())),
                Eigen::Vector3d::Zero()) *
         on_arc;
}

struct Film {
  synthetic::World world;
  Map map;
  std::vector<FramePose> trajectory;
};

Film MakeFilm() {
  Film film;
  film.world = synthetic::MakeWorld({.points = 400, .cameras = 10});
  for (int k = 0; k < 10; ++k) film.world.cam_from_world[k] = PoseAt(k);
  synthetic::MapOptions options;
  options.view.noise_px = 0.2;
  auto [map, landmarks] = synthetic::MakeMap(film.world, options);
  const Camera& camera = film.world.camera;
  for (const KeyframeId id : map.keyframes.Ids()) {
    const Keyframe& keyframe = map.keyframes.At(id);
    Features rolled = *keyframe.features;
    for (size_t i = 0; i < rolled.keypoints.size(); ++i) {
      if (!keyframe.landmarks[i].IsValid()) continue;
      const Eigen::Vector3d& x = map.landmarks.At(keyframe.landmarks[i]).position;
      const Eigen::Vector2d still = ProjectIdeal(camera, keyframe.cam_from_world * x);
      Eigen::Vector2d px = still;
      for (int round = 0; round < 3; ++round)
        px = ProjectIdeal(
            camera,
            PoseAt(keyframe.timestamp + ((px.y() + 0.5) / camera.height - 0.5) * kReadoutS) * x);
      rolled.keypoints[i].px += (px - still).cast<float>();
    }
    rolled.BuildGrid();
    for (const int step : {-1, 0, 1}) {
      const double time = keyframe.timestamp + step * kFrameS;
      film.trajectory.push_back({10 * static_cast<int>(id.value) + step, time, id,
                                 PoseAt(time) * PoseAt(keyframe.timestamp).Inverse(),
                                 TrackingState::kTracking});
    }
    map.keyframes.MutableAt(id).features = std::make_shared<const Features>(rolled);
  }
  film.map = map;
  return film;
}

double CenterError(const Map& map, const synthetic::World& world) {
  return CenterErrorsOf(synthetic::KeyframePoses(map), world.cam_from_world).rms;
}

TEST(RollingShutter, UndoingTheReadoutMendsThePoses) {
  const Film film = MakeFilm();
  Map as_is = film.map;
  ApplyCorrection(GlobalBundleAdjustment(as_is, 20, {}), as_is);
  const Map still = WithoutReadout(film.map, film.trajectory, kReadoutS, {});
  EXPECT_THAT(still.CheckInvariants(), IsEmpty());
  EXPECT_LT(CenterError(still, film.world), 0.4 * CenterError(as_is, film.world));
}

TEST(RollingShutter, TheReadoutIsFoundWithTheCamera) {
  Film film = MakeFilm();
  const double focal = film.world.camera.fx;
  film.map.cameras[0].fx = film.map.cameras[0].fy = 1.05 * focal;
  const SelfCalibration found =
      SelfCalibrate(film.map, 0, {.readout_sigma_s = 0.02}, film.trajectory);
  ASSERT_TRUE(found.success) << found.why_not;
  EXPECT_NEAR(found.readout_s, kReadoutS, 0.003);
  EXPECT_NEAR(found.camera.fx / focal, 1, 0.01);
}

TEST(RollingShutter, NoneIsFoundWhereThereIsNone) {
  const Film film = MakeFilm();
  const Map still = WithoutReadout(film.map, film.trajectory, kReadoutS, {});
  const SelfCalibration found = SelfCalibrate(still, 0, {.readout_sigma_s = 0.02}, film.trajectory);
  ASSERT_TRUE(found.success) << found.why_not;
  EXPECT_NEAR(found.readout_s, 0, 0.002);
}

TEST(RollingShutter, WithoutATrajectoryKeyPointsStay) {
  const Film film = MakeFilm();
  const Map still = WithoutReadout(film.map, {}, kReadoutS, {});
  const KeyframeId id(3);
  EXPECT_EQ(still.keyframes.At(id).features, film.map.keyframes.At(id).features);
}

}  // namespace
}  // namespace oaslam
