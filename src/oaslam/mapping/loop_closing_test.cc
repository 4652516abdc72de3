#include "oaslam/mapping/loop_closing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "synthetic_world.h"

namespace oaslam {
namespace {

using testing::IsEmpty;

constexpr uint32_t kHalf = 18;
const synthetic::WorldOptions kLongWay{.cameras = 60, .arc_deg = 360};

// The camera moves along the arc and back. On the way back the map has drifted and contains
// landmarks of its own.
struct Drifted {
  synthetic::World world;
  uint32_t half;
  Map map;
  std::vector<Rigid3> truth;

  explicit Drifted(double drift, const synthetic::WorldOptions& options = {.cameras = kHalf})
      : world(synthetic::MakeWorld(options)), half(static_cast<uint32_t>(options.cameras)) {
    truth = world.cam_from_world;
    for (uint32_t k = 0; k < half; ++k) truth.push_back(truth[half - 1 - k]);
    world.cam_from_world = truth;
    map = synthetic::MakeMap(world, {}).map;
    for (const LandmarkId id : map.landmarks.Ids()) Split(id);
    for (const LandmarkId id : map.landmarks.Ids()) {
      Landmark& landmark = map.landmarks.MutableAt(id);
      landmark.position =
          Moved(landmark.position, Share(landmark.observations.front().keyframe), drift);
    }
    for (uint32_t k = 0; k < 2 * half; ++k) {
      Rigid3& pose = map.keyframes.MutableAt(KeyframeId(k)).cam_from_world;
      pose.translation =
          -(pose.rotation * Moved(pose.OriginInSource(), Share(KeyframeId(k)), drift));
    }
    for (uint32_t k = 0; k < 2 * half; ++k) map.UpdateCovisibility(KeyframeId(k), 15);
  }

  double Error() const {
    double sum = 0;
    int count = 0;
    map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
      sum += (k.cam_from_world.OriginInSource() - truth[id.value].OriginInSource()).squaredNorm();
      ++count;
    });
    return std::sqrt(sum / count);
  }

 private:
  double Share(KeyframeId id) const { return id.value < half ? 0 : 1; }
  static Eigen::Vector3d Moved(const Eigen::Vector3d& x, double share, double drift) {
    return x + share * drift * Eigen::Vector3d(1, 0.5, 0.3);
  }
  void Split(LandmarkId id) {
    const std::vector<Observation> all = map.landmarks.At(id).observations;
    std::vector<Observation> back;
    for (const Observation& o : all)
      if (o.keyframe.value >= half) back.push_back(o);
    for (const Observation& o : back) map.EraseObservation(id, o.keyframe);
    if (back.size() < 2) return;
    const Eigen::Vector3d position =
        map.landmarks.Contains(id) ? map.landmarks.At(id).position : Eigen::Vector3d(0, 0, 0);
    if (!map.landmarks.Contains(id)) return;
    const LandmarkId twin = map.AddLandmark(position, back.front().keyframe);
    for (const Observation& o : back) map.AddObservation(twin, o.keyframe, o.keypoint);
    map.UpdateLandmark(twin);
  }
};

TEST(LoopClosing, JoinsBothEndsAndTakesTheDriftBack) {
  Drifted d(0.06);
  ASSERT_THAT(d.map.CheckInvariants(), IsEmpty());
  Rng rng(1);
  const KeyframeId current(2 * kHalf - 1);
  const auto loop = LoopDetector().Detect(d.map, current, rng);
  ASSERT_TRUE(loop);
  EXPECT_EQ(loop->current, current);
  EXPECT_LT(loop->old.value, 6U);
  EXPECT_NEAR(loop->old_from_current.scale, 1, 0.02);
  const Eigen::Vector3d center = d.map.keyframes.At(current).cam_from_world.OriginInSource();
  EXPECT_LT((loop->old_from_current * center - d.truth.back().OriginInSource()).norm(), 0.02);

  const double error_before = d.Error();
  const size_t landmarks_before = d.map.landmarks.size();
  CorrectLoop(*loop, 15, d.map);
  EXPECT_LT(d.Error(), error_before);
  EXPECT_LT(d.map.landmarks.size(), landmarks_before * 9 / 10);
  EXPECT_THAT(d.map.CheckInvariants(), IsEmpty());
  EXPECT_LT((d.map.keyframes.At(current).cam_from_world.OriginInSource() -
             d.truth.back().OriginInSource())
                .norm(),
            0.02);
}

TEST(LoopClosing, ContentMovesAndGrowsWithItsKeyframe) {
  Drifted d(0.06);
  Rng rng(1);
  const KeyframeId current(2 * kHalf - 1);
  auto loop = LoopDetector().Detect(d.map, current, rng);
  ASSERT_TRUE(loop);
  loop->old_from_current.scale = 1.2;  // a camera that has lost its scale on the way
  d.map.anchors["it"] = {
      "flag", 0.3, current, Rigid3(Eigen::Quaterniond::Identity(), {0.1, 0.2, 2}), {}, {0, 0, 1}};
  const Eigen::Vector3d before = WorldFromAnchor(d.map, d.map.anchors.at("it"))->translation;
  ASSERT_TRUE(CorrectLoop(*loop, 15, d.map));
  const Anchor& anchor = d.map.anchors.at("it");
  EXPECT_LT((WorldFromAnchor(d.map, anchor)->translation - loop->old_from_current * before).norm(),
            1e-9);
  EXPECT_NEAR(anchor.size, 0.36, 1e-9);
  EXPECT_NEAR(anchor.offset.z(), 1.2, 1e-9);
}

// The other end is too far away to be a candidate by position: it is found by appearance.
TEST(LoopClosing, ALargeDriftIsRecognisedAndObjectsMoveWithTheirKeyframes) {
  constexpr double kDrift = 8.5;
  Drifted d(kDrift, kLongWay);
  const KeyframeId current(2 * d.half - 3);
  const auto center = [&](uint32_t id) {
    return d.map.keyframes.At(KeyframeId(id)).cam_from_world.OriginInSource();
  };
  for (uint32_t k = 0; k < d.half; ++k)
    ASSERT_GT((center(k) - center(current.value)).norm(), d.map.MedianDepth(current));
  const Eigen::Vector3d true_center(0.3, -0.2, 0.1);
  Object object;
  object.state = ObjectState::kMapped;
  object.ellipsoid.center = true_center + kDrift * Eigen::Vector3d(1, 0.5, 0.3);
  object.ellipsoid.half_axes = {0.1, 0.1, 0.2};
  object.observations.resize(1);
  object.observations.front().anchor = current;
  d.map.objects.Insert(ObjectId(0), object);

  Rng rng(1);
  const auto loop = LoopDetector().Detect(d.map, current, rng);
  ASSERT_TRUE(loop);
  EXPECT_NEAR(loop->old_from_current.scale, 1, 0.02);
  const double error_before = d.Error();
  CorrectLoop(*loop, 15, d.map);
  EXPECT_LT(d.Error(), error_before);
  EXPECT_LT((center(current.value) - d.truth[current.value].OriginInSource()).norm(), 0.05);
  EXPECT_LT((d.map.objects.At(ObjectId(0)).ellipsoid.center - true_center).norm(), 0.1);
  EXPECT_THAT(d.map.CheckInvariants(), IsEmpty());
}

// Two places look the same, such as two windows: drift cannot displace the
// camera by half of its path.
TEST(LoopClosing, WhatDriftCannotExplainIsNoLoop) {
  const Drifted d(30, kLongWay);
  Rng rng(1);
  EXPECT_FALSE(LoopDetector().Detect(d.map, KeyframeId(2 * d.half - 3), rng));
}

TEST(LoopClosing, KeyframesThatShareLandmarksAreNoLoop) {
  const synthetic::MappedWorld mapped =
      synthetic::MakeMap(synthetic::MakeWorld({.cameras = 30, .arc_deg = 20}), {});
  Rng rng(1);
  EXPECT_FALSE(LoopDetector().Detect(mapped.map, KeyframeId(29), rng));
}

TEST(LoopClosing, ASimilarPlaceElsewhereIsNoLoop) {
  Drifted d(0.06);
  // With other descriptors it is another place at the same position.
  Rng rng(3);
  for (uint32_t k = 0; k < kHalf; ++k) {
    Keyframe& keyframe = d.map.keyframes.MutableAt(KeyframeId(k));
    auto features = std::make_shared<Features>(*keyframe.features);
    for (Descriptor& descriptor : features->descriptors)
      descriptor = synthetic::RandomDescriptor(rng);
    keyframe.features = features;
  }
  EXPECT_FALSE(LoopDetector().Detect(d.map, KeyframeId(2 * kHalf - 1), rng));
}

}  // namespace
}  // namespace oaslam
