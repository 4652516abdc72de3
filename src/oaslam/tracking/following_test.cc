#include "oaslam/tracking/following.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "synthetic_world.h"

namespace oaslam {
namespace {

// A camera that was at a keyframe and has moved on, where it sees few of the landmarks.
struct Passage {
  synthetic::World world = synthetic::MakeWorld({});
  Map map = synthetic::MakeMap(world, {}).map;
  Rigid3 truth = synthetic::PoseOnArc({}, 3);
  KeyframeId reference{4};
  Frame frame;
  TrackedFrame last;

  Passage() {
    Rng rng(9);
    frame.camera = std::make_shared<const Camera>(world.camera);
    frame.features = synthetic::MakeView(world, truth, {.missed = 0.8}, rng).features;
    const Keyframe& keyframe = map.keyframes.At(reference);
    last.frame.features = keyframe.features;
    last.reference = reference;
    last.landmarks = keyframe.landmarks;
  }
  // What becomes of a motion that is off by five centimetres.
  TrackReport Follow(double sigma_position) const {
    Rigid3 predicted = truth;
    predicted.translation.x() += 0.05;
    return FollowMotion(frame, map, last, {{predicted, sigma_position, 0.02}, reference}, {});
  }
  double Error(const TrackReport& report) const {
    return (report.cam_from_world.OriginInSource() - truth.OriginInSource()).norm();
  }
};

int CountLandmarks(const TrackReport& report) {
  return static_cast<int>(
      std::ranges::count_if(report.landmarks, [](LandmarkId id) { return id.IsValid(); }));
}

TEST(FollowMotion, LandmarksCorrectAMotionThatIsNotSure) {
  const Passage passage;
  const TrackReport report = passage.Follow(0.05);
  ASSERT_TRUE(report.success);
  EXPECT_LT(report.inliers, 200);
  EXPECT_LT(passage.Error(report), 0.01);
}

// What contradicts the motion may be a place that looks alike: neither its pose nor its landmarks
// are taken.
TEST(FollowMotion, FewLandmarksDoNotOutweighAMotionThatIsSure) {
  const Passage passage;
  const TrackReport report = passage.Follow(0.001);
  EXPECT_FALSE(report.success);
  EXPECT_NEAR(passage.Error(report), 0.05, 1e-9);
  EXPECT_EQ(report.landmarks.size(), passage.frame.features->keypoints.size());
  EXPECT_EQ(CountLandmarks(report), 0);
  EXPECT_EQ(report.inliers, 0);
  EXPECT_EQ(report.reference, passage.reference);
}

}  // namespace
}  // namespace oaslam
