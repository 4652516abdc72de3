#include "oaslam/tracking/pose_tracking.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "oaslam/tracking/initializer.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

struct Scene {
  synthetic::World world = synthetic::MakeWorld({});
  synthetic::MappedWorld mapped = synthetic::MakeMap(world, {});
  Rigid3 truth = synthetic::PoseOnArc({}, 3);
  Frame frame;

  explicit Scene(double missed = 0.1) {
    Rng rng(9);
    frame = MakeFrame(synthetic::MakeView(world, truth, {.missed = missed}, rng));
  }
  TrackReport FollowFromLast() const {
    const Keyframe& last = mapped.map.keyframes.At(KeyframeId(4));
    return TrackFromLastFrame(frame, mapped.map, *last.features, last.landmarks,
                              synthetic::PoseOnArc({}, 2.5), 15);
  }
  double Error(const TrackReport& report) const {
    return CenterDistance(report.cam_from_world, truth);
  }
};

TEST(PoseTracking, FollowsTheLastFrameThenTheLocalMap) {
  const Scene s;
  const TrackReport first = s.FollowFromLast();
  ASSERT_TRUE(first.success);
  const TrackReport tracked = TrackLocalMap(s.frame, s.mapped.map, first, {});
  ASSERT_TRUE(tracked.success);
  EXPECT_GT(tracked.inliers, first.inliers);
  EXPECT_LT(s.Error(tracked), 0.01);
  const double sigma = SigmaOfPosition(tracked.covariance);
  EXPECT_LT(s.Error(tracked), 3 * sigma);
  EXPECT_LT(sigma, SigmaOfPosition(first.covariance));  // of fewer landmarks
  EXPECT_TRUE(tracked.reference.IsValid());
  EXPECT_GE(tracked.visible.size(), static_cast<size_t>(tracked.inliers));
}

TEST(PoseTracking, AnImageOfNothingFails) {
  const Scene s;
  Rng rng(1);
  const Frame clutter =
      MakeFrame(synthetic::MakeView(s.world, s.truth, {.missed = 1.0, .clutter = 800}, rng));
  const Keyframe& last = s.mapped.map.keyframes.At(KeyframeId(4));
  const TrackReport first =
      TrackFromLastFrame(clutter, s.mapped.map, *last.features, last.landmarks, s.truth, 15);
  EXPECT_FALSE(first.success && TrackLocalMap(clutter, s.mapped.map, first, {}).success);
}

// A place that looks like the mapped one in part: two thirds of the landmarks are displaced.
TEST(PoseTracking, MayDemandThatWhatIsExpectedAgrees) {
  const Scene s;
  const TrackReport first = s.FollowFromLast();
  ASSERT_TRUE(first.success);
  Map elsewhere = s.mapped.map;
  for (const LandmarkId id : elsewhere.landmarks.Ids()) {
    if (id.value % 3 == 0) continue;
    Landmark& landmark = elsewhere.landmarks.MutableAt(id);
    const Eigen::Vector3d p = s.truth * landmark.position;
    const double angle = id.value;
    const double aside = 3 / elsewhere.cameras[0].fx * p.z();  // three pixels
    landmark.position =
        s.truth.Inverse() *
        (p + Eigen::Vector3d(aside * std::cos(angle), aside * std::sin(angle), 0)).eval();
  }
  const TrackReport tracked = TrackLocalMap(s.frame, elsewhere, first, {});
  EXPECT_TRUE(tracked.success);
  EXPECT_LT(tracked.inliers, 0.8 * tracked.matched);
  EXPECT_FALSE(TrackLocalMap(s.frame, elsewhere, first, {.agreement = 0.8}).success);
  EXPECT_TRUE(TrackLocalMap(s.frame, s.mapped.map, first, {.agreement = 0.8}).success);

  // All matches agree, but two thirds of the expected landmarks are not found.
  Map unlike = s.mapped.map;
  TrackReport third = first;
  Rng rng(4);
  for (const LandmarkId id : unlike.landmarks.Ids())
    if (id.value % 3 != 0)
      unlike.landmarks.MutableAt(id).descriptor = synthetic::RandomDescriptor(rng);
  for (LandmarkId& id : third.landmarks)
    if (id.value % 3 != 0) id = LandmarkId();
  const TrackReport few = TrackLocalMap(s.frame, unlike, third, {});
  EXPECT_GT(few.inliers, 0.9 * few.matched);
  EXPECT_FALSE(TrackLocalMap(s.frame, unlike, third, {.agreement = 0.8}).success);
}

TEST(LocalMap, HoldsTheKeyframesThatShareMostFirst) {
  const Scene s;
  const LocalMap local =
      CollectLocalMap(s.mapped.map, s.mapped.map.keyframes.At(KeyframeId(2)).landmarks, 5);
  ASSERT_EQ(local.keyframes.size(), 5U);
  EXPECT_EQ(local.keyframes.front(), KeyframeId(2));
  std::vector<LandmarkId> sorted = local.landmarks;
  std::ranges::sort(sorted);
  EXPECT_EQ(std::ranges::adjacent_find(sorted), sorted.end());
}

// The image comes with its true motion.
Frame FrameFrom(const synthetic::World& world, const Rigid3& pose, int index, Rng& rng) {
  Frame frame = MakeFrame(synthetic::MakeView(world, pose, {}, rng), index);
  frame.motion = synthetic::TrueMotion(index, pose);
  return frame;
}

TEST(Initializer, WaitsForParallaxAndThenMakesAMap) {
  // The lowest level carries the initialisation.
  const synthetic::World world = synthetic::MakeWorld({.farthest = 3.0});
  Initializer initializer;
  Rng views(5);
  std::optional<InitialMap> map;
  int at = 0;
  for (int i = 0; i < 40 && !map; ++i) {
    map = initializer.Process(FrameFrom(world, synthetic::PoseOnArc({}, 0.4 * i), i, views));
    at = i;
  }
  ASSERT_TRUE(map);
  EXPECT_GT(at, 1);
  EXPECT_GT(map->points.size(), 80U);
  const Rigid3 truth = synthetic::PoseOnArc({}, 0.4 * at) * synthetic::PoseOnArc({}, 0).Inverse();
  EXPECT_GT(map->second_from_first.translation.dot(truth.translation.normalized()), 0.98);
}

TEST(Initializer, NeverFromACameraThatOnlyTurns) {
  const synthetic::World world = synthetic::MakeWorld({.farthest = 3.0});
  Initializer initializer;
  Rng views(5);
  for (int i = 0; i < 25; ++i) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.008 * i, Eigen::Vector3d::UnitY()));
    const Rigid3 pose = Rigid3(turn, Eigen::Vector3d::Zero()) * synthetic::PoseOnArc({}, 0);
    EXPECT_FALSE(initializer.Process(FrameFrom(world, pose, i, views))) << i;
  }
  EXPECT_EQ(initializer.why_not(), "the camera only turned, or all it sees is far away");
}

TEST(Initializer, SaysWhyThereIsNoMapYet) {
  const synthetic::World world = synthetic::MakeWorld({});
  Initializer initializer;
  Rng views(5);
  Frame frame;
  frame.camera = std::make_shared<const Camera>(world.camera);
  const Rigid3 pose = synthetic::PoseOnArc({}, 0);
  for (frame.index = 0; frame.index < 3; ++frame.index) {
    frame.timestamp = frame.index / 10.0;
    frame.features = synthetic::MakeView(world, pose, {}, views).features;
    FrameMotion motion = *synthetic::TrueMotion(frame.index, pose);
    motion.is_preliminary = true;
    frame.motion = std::make_shared<const FrameMotion>(motion);
    EXPECT_FALSE(initializer.Process(frame));
  }
  EXPECT_EQ(initializer.why_not(), "the motion is not clear yet");
  for (; frame.index < 6; ++frame.index) {
    frame.timestamp = frame.index / 10.0;
    frame.motion = synthetic::TrueMotion(frame.index, pose);
    EXPECT_FALSE(initializer.Process(frame));
  }
  EXPECT_EQ(initializer.why_not(), "the camera has not moved");
  frame.features = std::make_shared<const Features>();
  EXPECT_FALSE(initializer.Process(frame));
  EXPECT_EQ(initializer.why_not(), "too few corners in the image");
}

TEST(PoseTracking, MatchesOfAllKeyPointsHoldAPoseOnFewLandmarks) {
  const Scene s;
  const Keyframe& last = s.mapped.map.keyframes.At(KeyframeId(4));
  TrackReport tracked = s.FollowFromLast();
  ASSERT_TRUE(tracked.success);
  int kept = 0;  // keep only the landmarks of the left quarter of the image
  for (size_t i = 0; i < tracked.landmarks.size(); ++i) {
    if (s.frame.features->keypoints[i].px.x() > 200) tracked.landmarks[i] = LandmarkId();
    kept += tracked.landmarks[i].IsValid();
  }
  ASSERT_GT(kept, 15);
  Frame before = s.frame;
  before.features = last.features;
  const TrackReport strong = StrengthenByMatches(s.frame, s.mapped.map, before, last.cam_from_world,
                                                 tracked, {.relative_sigma = 1});
  ASSERT_TRUE(strong.success);
  EXPECT_GE(strong.inliers, kept * 3 / 4);
  EXPECT_LT(s.Error(strong), 0.02);
}

// A camera that was at a keyframe and has moved on, where it sees few of the landmarks.
struct Passage : Scene {
  KeyframeId reference{4};
  TrackedFrame last;

  Passage() : Scene(0.8) {
    const Keyframe& keyframe = mapped.map.keyframes.At(reference);
    last.frame = frame;
    last.frame.features = keyframe.features;
    last.reference = reference;
    last.landmarks = keyframe.landmarks;
  }
  // What becomes of a motion that is off by five centimetres.
  TrackReport Follow(double sigma_position) const {
    Rigid3 predicted = truth;
    predicted.translation.x() += 0.05;
    return FollowMotion(frame, mapped.map, last, {{predicted, sigma_position, 0.02}, reference},
                        {});
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
