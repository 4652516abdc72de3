#include "oaslam/tracking/odometry_registration.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/geometry/similarity.h"
#include "object_table.h"

namespace oaslam {
namespace {

const Similarity kMapFromOdom(0.4,
                              Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY())),
                              {1, -2, 0.5});

Map TableWithThings() {
  Map map = object_table::EmptyMap();
  for (const object_table::TrueObject& thing : object_table::TableTop())
    synthetic::AddObject(map, MappedObject(thing));
  return map;
}

Rigid3 PoseAroundTable(int i) {
  return object_table::LookAt({1.6 * std::cos(0.01 * i), 1.6 * std::sin(0.01 * i), 0.9}, {0, 0, 0});
}

// Points on the sides of objects that face the camera have a depth.
Frame MovingFrame(int i, const Map& map, Rng& rng) {
  FrameMotion motion;
  motion.image = i;
  motion.cam_from_odom = (Similarity(PoseAroundTable(i)) * kMapFromOdom).AsPose();
  map.objects.ForEach([&](ObjectId, const Object& object) {
    const Eigen::Matrix3d axes = ScaledAxes(object.ellipsoid);
    const Eigen::Vector3d to_camera =
        axes.inverse() * (PoseAroundTable(i).OriginInSource() - object.ellipsoid.center);
    for (int k = 0; k < 5; ++k) {
      const Eigen::Vector3d off(rng.Gaussian(0.2), rng.Gaussian(0.2), rng.Gaussian(0.2));
      const Eigen::Vector3d on =
          object.ellipsoid.center + axes * (to_camera.normalized() + off).normalized();
      const Eigen::Vector3d in_cam = PoseAroundTable(i) * on;
      motion.depths.push_back({ProjectIdeal(object_table::kCamera, in_cam).cast<float>(),
                               static_cast<float>(kMapFromOdom.scale / in_cam.z())});
    }
  });
  Frame frame{i, i / 30.0, std::make_shared<const Camera>(object_table::kCamera), {}, {}};
  frame.motion = std::make_shared<const FrameMotion>(std::move(motion));
  return frame;
}

// A pose by objects.
Relocalization Located(int i, double sigma, Rng& rng) {
  Rigid3 world_from_cam = PoseAroundTable(i).Inverse();
  world_from_cam.translation +=
      Eigen::Vector3d(rng.Gaussian(sigma), rng.Gaussian(sigma), rng.Gaussian(sigma));
  Relocalization located;
  located.evidence = PoseEvidence::kObjects;
  located.cam_from_world = world_from_cam.Inverse();
  located.covariance.diagonal().head<3>().setConstant(sigma * sigma / 3);
  return located;
}

double ErrorOf(const Rigid3& pose, int i) { return CenterDistance(pose, PoseAroundTable(i)); }

TEST(OdometryRegistration, ManyImagesTellMoreThanOne) {
  const Map map = TableWithThings();
  Rng rng(2);
  OdometryRegistration registration;
  for (int i = 0; i < 40; ++i)
    registration.Add(MovingFrame(i, map, rng), Located(i, 0.03, rng), std::nullopt, map);
  // The last one shows nothing of the map.
  for (const int i : {20, 39, 60}) {
    const auto found = registration.PoseOf(MovingFrame(i, map, rng));
    ASSERT_TRUE(found.has_value()) << i;
    EXPECT_LT(ErrorOf(found->pose.cam_from_world, i), 0.02) << i;
    EXPECT_GT(found->agreeing, 0.8);
  }
}

TEST(OdometryRegistration, OneImageIsEnoughWhereObjectsTellTheUnit) {
  const Map map = TableWithThings();
  Rng rng(3);
  OdometryRegistration registration;
  registration.Add(MovingFrame(0, map, rng), Located(0, 1e-3, rng), std::nullopt, map);
  const auto found = registration.PoseOf(MovingFrame(20, map, rng));
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(ErrorOf(found->pose.cam_from_world, 20), 0.02);  // of .32
}

TEST(OdometryRegistration, KnowsNothingOfOtherRunsOrLongAfter) {
  const Map map = TableWithThings();
  Rng rng(4);
  OdometryRegistration registration;
  EXPECT_FALSE(registration.PoseOf(MovingFrame(0, map, rng)));
  Frame preliminary = MovingFrame(0, map, rng);
  FrameMotion motion = *preliminary.motion;
  motion.is_preliminary = true;
  preliminary.motion = std::make_shared<const FrameMotion>(motion);
  registration.Add(preliminary, Located(0, 0.01, rng), 0.4, map);
  EXPECT_FALSE(registration.PoseOf(MovingFrame(1, map, rng)));
  for (int i = 0; i < 20; ++i)
    registration.Add(MovingFrame(i, map, rng), Located(i, 0.01, rng), 0.4, map);
  EXPECT_TRUE(registration.PoseOf(MovingFrame(20, map, rng)));
  EXPECT_FALSE(registration.PoseOf(preliminary));
  EXPECT_FALSE(registration.PoseOf(MovingFrame(20 + 30 * 60, map, rng)));
  Frame cut = MovingFrame(21, map, rng);
  motion = *cut.motion;
  motion.run = 1;
  cut.motion = std::make_shared<const FrameMotion>(motion);
  EXPECT_FALSE(registration.PoseOf(cut));
  cut.motion = nullptr;
  EXPECT_FALSE(registration.PoseOf(cut));
}

TEST(OdometryRegistration, ImagesMustAgree) {
  const Map map = TableWithThings();
  Rng rng(5);
  OdometryRegistration registration;
  for (int i = 0; i < 40; ++i) {
    Relocalization located = Located(i, 0.5, rng);
    located.covariance *= 0.01 * 0.01 / (0.5 * 0.5);
    registration.Add(MovingFrame(i, map, rng), located, 0.4, map);
  }
  EXPECT_FALSE(registration.PoseOf(MovingFrame(40, map, rng)));
}

}  // namespace
}  // namespace oaslam
