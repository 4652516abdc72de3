#include "oaslam/matching/depth_alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "cameras.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

// The corner of a room: the floor and two walls, 2 m from the camera.
constexpr double kWall = 2;

// The distance along a ray to the nearest of them, from a point in the room; world.
double DistanceToWall(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, int walls) {
  double nearest = 1e9;
  for (int axis = 0; axis < walls; ++axis)
    if (ray[axis] > 1e-9) nearest = std::min(nearest, (kWall - from[axis]) / ray[axis]);
  return nearest;
}

Rigid3 IntoTheCorner() {
  const Eigen::Vector3d forward = Eigen::Vector3d(1, 1.1, 0.9).normalized(),
                        right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d world_from_cam;
  world_from_cam << right, forward.cross(right), forward;
  return Rigid3(Eigen::Quaterniond(world_from_cam.transpose()), Eigen::Vector3d::Zero());
}

class DepthAlignmentTest : public testing::Test {
 protected:
  // A frame at the true pose with noisy depths, and a map of landmarks on the first `walls` walls.
  void Build(int walls) {
    constexpr int kWidth = 160, kHeight = 120;
    const Rigid3 world_from_cam = truth_.Inverse();
    const Camera& camera = synthetic::kCamera;
    const auto z_at = [&](double x, double y) {
      const Eigen::Vector3d ray = RayOf(camera, {x, y});
      return DistanceToWall(world_from_cam.translation, world_from_cam.rotation * ray, walls);
    };
    std::vector<float> z;
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        z.push_back(static_cast<float>(z_at(4 * x + 1.5, 4 * y + 1.5) + rng_.Gaussian(.005)));
    frame_.camera = std::make_shared<const Camera>(camera);
    frame_.depth =
        std::make_shared<const DepthMap>(kWidth, kHeight, std::move(z), 640, 480, .002, .002);
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector2d px(rng_.Uniform(0, 640), rng_.Uniform(0, 480));
      Landmark landmark;
      landmark.position =
          world_from_cam * (z_at(px.x(), px.y()) * RayOf(camera, px)) +
          .01 * Eigen::Vector3d(rng_.Gaussian(1), rng_.Gaussian(1), rng_.Gaussian(1));
      map_.landmarks.Insert(LandmarkId(static_cast<uint32_t>(i)), std::move(landmark));
    }
    map_.is_metric = true;
  }
  static Rigid3 Off(double metres, double degrees) {
    return {Eigen::Quaterniond(
                Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d(1, -2, 1).normalized())),
            metres * Eigen::Vector3d(1, 1, -1).normalized()};
  }
  static PoseCovariance Sigmas(double metres, double degrees) {
    return ExpectedPose{{}, metres, degrees * M_PI / 180}.Covariance();
  }
  std::optional<AlignedPose> Align(const Rigid3& guess, const PoseCovariance& covariance) const {
    return AlignToDepths(frame_, LandmarksBeforeDepths(frame_, map_, guess), {guess, covariance},
                         .01);
  }
  double ErrorOf(const Rigid3& pose) const {
    return (pose.OriginInSource() - truth_.OriginInSource()).norm();
  }

  Rng rng_{1};
  const Rigid3 truth_ = IntoTheCorner();
  Frame frame_;
  Map map_;
};

TEST_F(DepthAlignmentTest, LandmarksThatNobodyRecognizesTellThePose) {
  Build(3);
  const Rigid3 guess = Off(.25, 5) * truth_;
  const auto aligned = Align(guess, Sigmas(.15, 3));
  ASSERT_TRUE(aligned);
  EXPECT_GT(ErrorOf(guess), .2);
  EXPECT_LT(ErrorOf(aligned->cam_from_world), .05);
  EXPECT_LT(aligned->cam_from_world.rotation.angularDistance(truth_.rotation), .03);
  EXPECT_LT(SigmaOfPosition(aligned->covariance), .08);
}

TEST_F(DepthAlignmentTest, RoomsBehindTheWallsDoNotCount) {
  Build(3);
  for (uint32_t i = 0; i < 4000; ++i) {  // in the view, behind the walls
    Landmark landmark;
    landmark.position = {rng_.Uniform(3.5, 9), rng_.Uniform(3.5, 9), rng_.Uniform(3, 8)};
    map_.landmarks.Insert(LandmarkId(1000 + i), std::move(landmark));
  }
  const auto aligned = Align(Off(.25, 5) * truth_, Sigmas(.15, 3));
  ASSERT_TRUE(aligned);
  EXPECT_LT(ErrorOf(aligned->cam_from_world), .05);
}

TEST_F(DepthAlignmentTest, AlongAWallThePoseStaysAsUncertainAsItWas) {
  Build(1);
  const auto aligned = Align(truth_, Sigmas(.1, 2));
  ASSERT_TRUE(aligned);
  // In the frame of the camera, in which the covariance is.
  const Eigen::Vector3d along = truth_.rotation * Eigen::Vector3d::UnitY(),
                        normal = truth_.rotation * Eigen::Vector3d::UnitX();
  const Eigen::Matrix3d of_position = aligned->covariance.topLeftCorner<3, 3>();
  EXPECT_GT(std::sqrt(along.dot(of_position * along)), .05);
  EXPECT_LT(std::sqrt(normal.dot(of_position * normal)), .03);
}

TEST_F(DepthAlignmentTest, NeedsAMetreDepthsAndLandmarks) {
  Build(3);
  EXPECT_GT(LandmarksBeforeDepths(frame_, map_, truth_).size(), 300);
  EXPECT_FALSE(AlignToDepths(frame_, {}, {truth_, Sigmas(.1, 2)}, .01));
  map_.is_metric = false;
  EXPECT_TRUE(LandmarksBeforeDepths(frame_, map_, truth_).empty());
  map_.is_metric = true;
  frame_.depth.reset();
  EXPECT_TRUE(LandmarksBeforeDepths(frame_, map_, truth_).empty());
}

TEST_F(DepthAlignmentTest, APoseWhoseLandmarksWouldMostlyBeHiddenIsNoAlignment) {
  Build(3);
  ASSERT_TRUE(Align(truth_, Sigmas(.02, .1)));
  const Eigen::Vector3d camera = truth_.OriginInSource();
  for (uint32_t i = 0; i < 400; ++i)
    for (uint32_t copy = 1; copy < 3; ++copy) {
      Landmark landmark;
      landmark.position = camera + 1.25 * (map_.landmarks.At(LandmarkId(i)).position - camera);
      map_.landmarks.Insert(LandmarkId(1000 * copy + i), std::move(landmark));
    }
  EXPECT_FALSE(Align(truth_, Sigmas(.02, .1)));
}

TEST_F(DepthAlignmentTest, TheCameraSeesThroughTheLandmarksOfAWrongPose) {
  Build(3);
  const auto compared_at = [&](double forward) {
    const Rigid3 pose = Rigid3(Eigen::Quaterniond::Identity(), {0, 0, -forward}) * truth_;
    return CompareDepths(frame_, LandmarksBeforeDepths(frame_, map_, pose), {pose, Sigmas(.02, 1)},
                         .01);
  };
  EXPECT_FALSE(compared_at(0).Contradicts());
  EXPECT_GT(compared_at(0).agree, 300);
  EXPECT_TRUE(compared_at(1).Contradicts());
  EXPECT_EQ(compared_at(-.5).seen_through, 0) << "hidden, which may be";
}

}  // namespace
}  // namespace oaslam
