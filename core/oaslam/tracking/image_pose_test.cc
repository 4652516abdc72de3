#include "oaslam/tracking/image_pose.h"

#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

class PoseCertaintyTest : public testing::Test {
 protected:
  PoseCertaintyTest() {
    frame_.camera = std::make_shared<const Camera>();
    tracked_.reference = KeyframeId(0);
    tracked_.matched = tracked_.inliers = 200;
    tracked_.depth = 3;
    tracked_.covariance.diagonal().head<3>().setConstant(1e-4);
  }

  ImagePose Reported(TrackingState state = TrackingState::kTracking) {
    return certainty_.PoseToReport(frame_, map_, tracked_, state, OdometryLink(), best_confidence_);
  }

  Map map_ = synthetic::MakeMap(synthetic::MakeWorld({}), {}).map;
  Frame frame_;
  TrackReport tracked_;
  double best_confidence_ = 0;
  PoseCertainty certainty_;
};

TEST_F(PoseCertaintyTest, ManyLandmarksAreSure) {
  const ImagePose pose = Reported();
  EXPECT_EQ(pose.source, PoseSource::kMap);
  EXPECT_GT(pose.confidence, 0.95);
  EXPECT_FALSE(pose.is_uncertain);
  EXPECT_GT(SigmaOfPosition(pose.covariance), SigmaOfPosition(tracked_.covariance));
}

// A pose near where the motion led is as right as the one before it.
TEST_F(PoseCertaintyTest, FewLandmarksDoNotRefuteWhatManySaidBefore) {
  tracked_.inliers = 20;
  EXPECT_LT(Reported().confidence, 0.9);
  tracked_.inliers = 200;
  const double sure = Reported().confidence;
  tracked_.inliers = 20;
  EXPECT_NEAR(Reported().confidence, sure, 1e-9);
}

TEST_F(PoseCertaintyTest, AFocalLengthThatIsRoughlyKnownIsInTheCovariance) {
  const PoseCovariance known = Reported().covariance;
  Camera camera;
  camera.focal_sigma = 0.1;
  frame_.camera = std::make_shared<const Camera>(camera);
  const PoseCovariance rough = Reported().covariance;
  EXPECT_NEAR(rough(2, 2) - known(2, 2), 0.3 * 0.3, 1e-9);  // along the axis, a tenth of the depth
  EXPECT_EQ(rough(0, 0), known(0, 0));
}

TEST_F(PoseCertaintyTest, AWidePoseIsUncertain) {
  tracked_.covariance.diagonal().head<3>().setConstant(0.09);  // a tenth of the depth
  const ImagePose pose = Reported();
  EXPECT_TRUE(pose.is_uncertain);
  EXPECT_LT(pose.confidence, 0.9);
}

TEST_F(PoseCertaintyTest, FarFromTheMiddleTheMapMayBeOff) {
  tracked_.reference = KeyframeId(4);
  const double near = SigmaOfPosition(Reported().covariance);
  tracked_.reference = KeyframeId(7);
  EXPECT_GT(SigmaOfPosition(Reported().covariance), near);
}

// Where the odometry has lost the scale, what lies beyond is not known to its distance from there;
// around itself it is as sure as before.
TEST_F(PoseCertaintyTest, BeyondALostScaleAPlaceIsUnsure) {
  for (const KeyframeId id : map_.keyframes.Ids())
    map_.keyframes.MutableAt(id).scale_drift = ScaleDrift{0, 0};
  tracked_.reference = KeyframeId(7);
  tracked_.cam_from_world = map_.keyframes.At(KeyframeId(7)).cam_from_world;
  const ImagePose before = Reported();
  map_.keyframes.MutableAt(KeyframeId(6)).scale_drift =
      map_.keyframes.MutableAt(KeyframeId(7)).scale_drift = ScaleDrift{0, 0.25};
  certainty_ = {};
  const ImagePose pose = Reported();
  EXPECT_GT(SigmaOfPosition(pose.covariance), SigmaOfPosition(before.covariance));
  EXPECT_EQ(pose.confidence, before.confidence);
  EXPECT_EQ(pose.is_uncertain, before.is_uncertain);
}

TEST_F(PoseCertaintyTest, APoseByTheMotionSaysForHowLong) {
  best_confidence_ = 1;
  OdometryLink link;
  TrackedFrame seen;
  seen.frame.timestamp = 1;
  link.See(seen, 3, map_, nullptr);
  const auto after = [&](double seconds) {
    frame_.timestamp = 1 + seconds;
    return certainty_.PoseToReport(frame_, map_, tracked_, TrackingState::kOdometry, link,
                                   best_confidence_);
  };
  const ImagePose pose = after(3);
  EXPECT_EQ(pose.source, PoseSource::kMotion);
  EXPECT_DOUBLE_EQ(pose.seconds_without_map, 3);
  EXPECT_TRUE(pose.is_uncertain);
  EXPECT_FALSE(after(0.1).is_uncertain);
}

// What hardly anything ties to the rest of the map may have another scale.
TEST_F(PoseCertaintyTest, InALoosePartAPoseIsUncertain) {
  EXPECT_FALSE(Reported().is_uncertain);
  const KeyframeId loose(map_.keyframes.Bound().value);
  Keyframe keyframe = map_.keyframes.At(KeyframeId(0));
  keyframe.covisible.clear();
  map_.keyframes.Insert(loose, std::move(keyframe));
  tracked_.reference = loose;
  EXPECT_TRUE(Reported().is_uncertain);
}

}  // namespace
}  // namespace oaslam
