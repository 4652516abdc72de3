#include "oaslam/tracking/object_watch.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/ellipsoid.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

class ObjectWatchTest : public testing::Test {
 protected:
  // An image with a pose that shows one box.
  TrackedFrame SeenAt(int image, bool detections_follow = false) {
    const Rigid3 pose = synthetic::PoseOnArc({}, -20 + 0.4 * image);
    TrackedFrame seen;
    seen.frame = MakeFrame(synthetic::MakeView(world_, pose, {}, rng_), image);
    seen.frame.detections_follow = detections_follow;
    if (!detections_follow) seen.frame.detections = {Detected(pose)};
    seen.cam_from_world = pose;
    seen.reference = KeyframeId(0);
    seen.cam_from_reference = pose * map_.keyframes.At(KeyframeId(0)).cam_from_world.Inverse();
    seen.landmarks.resize(seen.frame.features->keypoints.size());
    return seen;
  }

  ObjectDetection Detected(const Rigid3& pose) const {
    const Ellipsoid thing{Eigen::Vector3d::Zero(), {0.3, 0.3, 0.3}, Eigen::Quaterniond::Identity()};
    return {5, 0.9, *ProjectToBox(thing, pose, world_.camera), 0};
  }

  synthetic::World world_ = synthetic::MakeWorld({});
  Map map_ = synthetic::MakeMap(world_, {}).map;
  Rng rng_{3};
  uint32_t next_object_ = 7;
  ObjectWatch watch_{ObjectsConfig{}};
};

// Two submaps that are tracked side by side take the ids of new objects from one source.
TEST_F(ObjectWatchTest, NewObjectsGetFreeIds) {
  ObjectWatch other{ObjectsConfig{}};
  const TrackedFrame seen = SeenAt(0);
  watch_.Observe(seen, map_, next_object_);
  other.Observe(seen, map_, next_object_);
  const auto here = watch_.TakeSightings(), there = other.TakeSightings();
  ASSERT_EQ(here.size(), 1U);
  ASSERT_EQ(there.size(), 1U);
  EXPECT_EQ(here[0].object, ObjectId(7));
  EXPECT_EQ(there[0].object, ObjectId(8));
  EXPECT_EQ(watch_.ObjectsIn(seen.frame), std::vector{ObjectId(7)});
  EXPECT_TRUE(watch_.TakeSightings().empty());
}

TEST_F(ObjectWatchTest, AnImageWaitsForItsDetectionsWithItsPose) {
  const TrackedFrame first = SeenAt(0, true), second = SeenAt(1, true);
  watch_.Await(first.frame);
  watch_.Await(second.frame);
  EXPECT_EQ(watch_.Observe(second, map_, next_object_), 0);
  EXPECT_FALSE(watch_.TakeAwaited(2));
  ObjectWatch scaled = watch_;
  scaled.Scale(2);
  const auto late = watch_.TakeAwaited(1), late_scaled = scaled.TakeAwaited(1);
  ASSERT_TRUE(late && late_scaled);
  EXPECT_EQ(late->reference, KeyframeId(0));
  EXPECT_EQ(late_scaled->cam_from_reference.translation, 2 * late->cam_from_reference.translation);
  EXPECT_FALSE(watch_.TakeAwaited(0));  // passed over
}

TEST_F(ObjectWatchTest, AnImageWithoutAPoseWaitsWithoutOne) {
  watch_.Await(SeenAt(0, true).frame);
  const auto late = watch_.TakeAwaited(0);
  ASSERT_TRUE(late);
  EXPECT_FALSE(late->reference.IsValid());
}

TEST_F(ObjectWatchTest, WhatAnotherSawAndAwaitsComesFirst) {
  ObjectWatch other{ObjectsConfig{}};
  other.Observe(SeenAt(0), map_, next_object_);
  watch_.Observe(SeenAt(1), map_, next_object_);
  for (const int image : {2, 3, 4}) other.Await(SeenAt(image, true).frame);
  for (const int image : {4, 5}) watch_.Await(SeenAt(image, true).frame);
  watch_.AddBefore(std::move(other));
  for (const int image : {2, 3, 4, 5}) EXPECT_TRUE(watch_.TakeAwaited(image)) << image;
  const auto sightings = watch_.TakeSightings();
  ASSERT_EQ(sightings.size(), 2U);
  EXPECT_LT(sightings[0].timestamp, sightings[1].timestamp);
}

}  // namespace
}  // namespace oaslam
