#include <gtest/gtest.h>

#include "matchers.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/system/session.h"
#include "offline_config.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

// Ellipsoids on the surface of the synthetic world, each of its own class.
std::vector<Ellipsoid> Things() {
  std::vector<Ellipsoid> things;
  for (int i = 0; i < 8; ++i)
    things.push_back({Eigen::Vector3d(-1.2 + 0.8 * (i % 4), i < 4 ? -0.5 : 0.4, 0.15 * (i % 3)),
                      Eigen::Vector3d(0.15 + 0.01 * i, 0.2, 0.25 - 0.01 * i),
                      Eigen::Quaterniond::Identity()});
  return things;
}

class LateDetections : public testing::Test {
 protected:
  static constexpr int kBlind = 100;  // the first frame without points

  static Rigid3 TruePose(int frame) { return synthetic::PoseOnArc({}, -20 + 0.4 * frame); }

  std::vector<ObjectDetection> Detect(int frame) const {
    std::vector<ObjectDetection> found;
    for (size_t i = 0; i < things_.size(); ++i)
      if (const auto box = ProjectToBox(things_[i], TruePose(frame), world_.camera))
        found.push_back({static_cast<int>(i), 0.9, *box, 0});
    return found;
  }

  static SlamConfig Config() {
    SlamConfig config = OfflineIn();
    config.objects.min_observations = 20;
    config.objects.min_parallax_deg = 5;
    return config;
  }

  // Processes frames up to `count`. Every `stride`th frame gets detections, `lag` frames late; with
  // `lag` 0 they come with the frame.
  void Walk(Session& session, int count, int lag, int stride, int first_blind = kBlind) {
    Rng rng(7);
    for (int i = 0; i < count; ++i) {
      const bool blind = i >= first_blind;
      Frame frame = MakeFrame(
          synthetic::MakeView(world_, TruePose(i), {.missed = blind ? 1.0 : 0.1}, rng), i);
      constexpr int kBeginning = 30;  // frames with which the map begins
      if (i < kBeginning) frame.motion = synthetic::TrueMotion(i, TruePose(i));
      frame.detections_follow = lag > 0;
      if (lag == 0 && i % stride == 0) frame.detections = Detect(i);
      states_.push_back(session.Process(frame, Context()).pose.state);
      if (lag > 0 && i >= lag && (i - lag) % stride == 0) {
        const auto late = session.AddDetections(i - lag, Detect(i - lag), Context());
        if (late) seen_ = std::max(seen_, late->pose.objects);
      }
    }
  }

  TrackingContext Context() {
    return {.next_keyframe = &next_keyframe_, .next_object = &next_object_};
  }

  const synthetic::World world_ = synthetic::MakeWorld({.farthest = 3.6});
  std::vector<Ellipsoid> things_ = Things();
  std::vector<TrackingState> states_;
  int seen_ = 0;
  uint32_t next_keyframe_ = 0, next_object_ = 0;
};

TEST_F(LateDetections, MapTheObjectsOfDetectionsThatComeAtOnce) {
  Session at_once(Config(), synthetic::EmptyMap(), false),
      late(Config(), synthetic::EmptyMap(), false);
  Walk(at_once, kBlind, 0, 2);
  Walk(late, kBlind, 9, 2);
  at_once.Finish(MapUse::kExtend);
  late.Finish(MapUse::kExtend);
  const std::shared_ptr<const Map> a = at_once.Newest(), b = late.Newest();
  int mapped = 0;
  a->objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    ++mapped;
    double nearest = 1e9;
    b->objects.ForEach([&](ObjectId, const Object& other) {
      if (other.state == ObjectState::kMapped && other.category_id == object.category_id)
        nearest = std::min(nearest, (other.ellipsoid.center - object.ellipsoid.center).norm() /
                                        object.ellipsoid.half_axes.maxCoeff());
    });
    EXPECT_LT(nearest, 0.15) << object.category_id;
  });
  EXPECT_GE(mapped, 6);
  EXPECT_GE(seen_, 6);
  EXPECT_THAT(b->CheckInvariants(), IsEmpty());
}

TEST_F(LateDetections, CountForTheFrameTheyAreOfOrNotAtAll) {
  Session session(Config(), synthetic::EmptyMap(), false);
  Walk(session, 60, 5, 1);
  EXPECT_FALSE(session.AddDetections(54, Detect(54), Context()));  // has had its detections
  EXPECT_FALSE(session.AddDetections(2, Detect(2), Context()));    // passed over
  EXPECT_FALSE(session.AddDetections(60, Detect(60), Context()));  // not there yet
  EXPECT_TRUE(session.AddDetections(57, Detect(57), Context()));
  EXPECT_FALSE(session.AddDetections(56, Detect(56), Context()));  // passed over
}

TEST_F(LateDetections, CountForTheLast120FramesOnly) {
  constexpr int kFrames = 160;
  Session session(Config(), synthetic::EmptyMap(), false);
  Walk(session, kFrames, kFrames, 1, kFrames);  // no detections arrive meanwhile
  EXPECT_EQ(states_[kFrames - 121], TrackingState::kTracking);
  EXPECT_FALSE(session.AddDetections(kFrames - 121, Detect(kFrames - 121), Context()));
  EXPECT_TRUE(session.AddDetections(kFrames - 120, Detect(kFrames - 120), Context()));
}

TEST_F(LateDetections, FindALostCameraByObjects) {
  Session session(Config(), synthetic::EmptyMap(), false);
  Walk(session, kBlind + 5, 3, 1);
  EXPECT_EQ(states_.back(), TrackingState::kLost);
  const auto found = session.AddDetections(kBlind + 3, Detect(kBlind + 3), Context());
  ASSERT_TRUE(found);
  EXPECT_GT(found->pose.depth, 0.5);
  ASSERT_TRUE(found->located);
  // The distance from a tracked frame, in units of the distance from frame 40 to that frame, so
  // that it does not depend on the map's unit.
  const auto pose_of = [&](int frame) {
    for (const FramePose& pose : session.tracker().trajectory())
      if (pose.frame_index == frame)
        return pose.cam_from_reference * *session.snapshot()->ResolvePose(pose.reference);
    ADD_FAILURE() << "frame " << frame << " has no pose";
    return Rigid3();
  };
  const double found_ratio = CenterDistance(found->located->cam_from_world, pose_of(90)) /
                             CenterDistance(pose_of(90), pose_of(40));
  const double true_ratio = CenterDistance(TruePose(kBlind + 3), TruePose(90)) /
                            CenterDistance(TruePose(90), TruePose(40));
  EXPECT_NEAR(found_ratio, true_ratio, 0.1);
}

}  // namespace
}  // namespace oaslam
