#include "oaslam/relocalization/by_points.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/degree.h"
#include "place_world.h"

namespace oaslam {
namespace {

using synthetic::DescribedWorld;
using synthetic::MakeFrame;
using synthetic::PlaceWorld;
using synthetic::PoseOnArc;
using synthetic::View;

Relocalization Find(const PlaceWorld& f, const View& view, Rng& rng) {
  return RelocalizeByPoints(MakeFrame(view), f.mapped.map, f.index, {}, rng);
}

TEST(RelocalizeByPoints, FindsViewsBetweenTheKeyframes) {
  const PlaceWorld f;
  for (const double angle : {-25.0, -3.0, 12.0, 27.0}) {
    Rng rng(static_cast<uint64_t>(angle + 100));
    const Rigid3 truth = synthetic::Disturb(PoseOnArc({}, angle), 0.1, 0.05, rng);
    const View view =
        MakeView(f.world, truth, {.flipped_bits = 30, .missed = 0.3, .clutter = 300}, rng);
    const Relocalization report = Find(f, view, rng);
    ASSERT_TRUE(report.IsFound()) << angle << ": " << report.why_not;
    EXPECT_LT(CenterDistance(report.cam_from_world, truth), 0.02) << angle;
    EXPECT_LT(report.sigma_position(), 0.02);
    ASSERT_EQ(report.points.landmarks.size(), view.point_of_keypoint.size());
    int right = 0, inliers = 0;
    for (size_t k = 0; k < report.points.landmarks.size(); ++k) {
      if (!report.points.landmarks[k].IsValid()) continue;
      ++inliers;
      right += view.point_of_keypoint[k] >= 0 &&
               f.mapped.landmark_of_point[view.point_of_keypoint[k]] == report.points.landmarks[k];
    }
    EXPECT_EQ(inliers, report.points.inliers);
    EXPECT_GT(right, 0.97 * inliers);
  }
}

TEST(RelocalizeByPoints, RefusesAnotherWorld) {
  const PlaceWorld f;
  synthetic::WorldOptions other = synthetic::kPlaceWorld;
  other.seed = 77;
  const synthetic::World elsewhere = synthetic::MakeWorld(other);
  for (uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    const View view = MakeView(elsewhere, PoseOnArc({}, 0), {}, rng);
    const Relocalization report = Find(f, view, rng);
    EXPECT_FALSE(report.IsFound());
    EXPECT_FALSE(report.why_not.empty());
  }
}

TEST(RelocalizeByPoints, LeavesOutPlacesSeenFromTheOtherSide) {
  const PlaceWorld f;
  Rng rng(5);
  const Rigid3 truth = PoseOnArc({}, 5);
  const Frame frame = MakeFrame(MakeView(f.world, truth, {}, rng));
  const auto found_with = [&](double degrees) {
    const Rigid3 turned =
        Rigid3{Eigen::Quaterniond(Eigen::AngleAxisd(degrees * kDegree, Eigen::Vector3d::UnitY())),
               Eigen::Vector3d::Zero()} *
        truth;
    return RelocalizeByPoints(frame, f.mapped.map, f.index, {}, rng, Appearance::kOrb, turned);
  };
  EXPECT_TRUE(found_with(20).IsFound());
  EXPECT_TRUE(found_with(120).candidates.empty());
}

// A strip of the image agrees exactly; of what should be in view beside it, nothing is there.
TEST(RelocalizeByPoints, WhatShouldBeThereAndIsNotCountsAgainstAPose) {
  const PlaceWorld f;
  Rng rng(5);
  const View view = MakeView(f.world, PoseOnArc({}, 5), {}, rng);
  const Relocalization whole = Find(f, view, rng);
  ASSERT_TRUE(whole.IsFound()) << whole.why_not;
  std::vector<uint32_t> kept;
  for (uint32_t k = 0; k < view.features->keypoints.size(); ++k)
    if (view.features->keypoints[k].px.x() < view.features->bounds.Width() / 4) kept.push_back(k);
  Frame part;
  part.camera = view.camera;
  part.features = std::make_shared<const Features>(view.features->Selected(kept));
  const Relocalization found = RelocalizeByPoints(part, f.mapped.map, f.index, {}, rng);
  EXPECT_GT(found.points.inliers, 50);
  EXPECT_LT(found.points.covered, whole.points.covered / 2);
  EXPECT_LT(found.confidence, 0.999);
  EXPECT_LT(1 - whole.confidence, 0.1 * (1 - found.confidence));
}

TEST(RelocalizeByPoints, FindsByLearnedDescriptorsWhereOrbFails) {
  for (const bool all_landmarks : {true, false}) {
    DescribedWorld f(all_landmarks);
    const Rigid3 truth = PoseOnArc({}, 7);
    const View view = MakeView(f.world, truth, {.flipped_bits = 20, .missed = 0.3}, f.rng);
    Frame frame = MakeFrame(view);
    frame.features = synthetic::KnownByLearned(*view.features, f.rng);
    EXPECT_FALSE(RelocalizeByPoints(frame, f.mapped.map, f.index, {}, f.rng).IsFound());
    const Relocalization found =
        RelocalizeByPoints(frame, f.mapped.map, f.index, {}, f.rng, Appearance::kLearned);
    ASSERT_TRUE(found.IsFound()) << found.why_not;
    EXPECT_LT(CenterDistance(found.cam_from_world, truth), 0.02);
  }
}

TEST(RelocalizeByPoints, AnEmptyMapOrFrameFails) {
  const PlaceWorld f;
  Rng rng(1);
  View nothing = MakeView(f.world, f.world.cam_from_world[0], {.missed = 1, .clutter = 0}, rng);
  EXPECT_FALSE(Find(f, nothing, rng).IsFound());
  const Map empty = synthetic::EmptyMap();
  const View view = MakeView(f.world, f.world.cam_from_world[0], {}, rng);
  EXPECT_FALSE(RelocalizeByPoints(MakeFrame(view), empty, PlaceIndex(empty), {}, rng).IsFound());
}

TEST(RelocalizeByPoints, LandmarksErasedSinceAreSkipped) {
  PlaceWorld f;
  const auto ids = f.mapped.map.landmarks.Ids();
  for (size_t i = 0; i < ids.size(); i += 2) f.mapped.map.EraseLandmark(ids[i]);
  f.mapped.map.RetireKeyframe(KeyframeId(3));
  Rng rng(2);
  const View view = MakeView(f.world, f.world.cam_from_world[3], {}, rng);
  EXPECT_TRUE(Find(f, view, rng).IsFound());
}

// The world seen through another lens: the image's camera is not the map's.
TEST(RelocalizeByPointsAndFocal, FindsTheFocalLengthOfASingleImage) {
  PlaceWorld f;
  for (const double focal : {380.0, 520.0, 700.0}) {
    synthetic::World seen = f.world;
    seen.camera.fx = seen.camera.fy = focal;
    for (const double angle : {-20.0, 8.0}) {
      Rng rng(static_cast<uint64_t>(angle + focal));
      const Rigid3 truth = synthetic::Disturb(PoseOnArc({}, angle), 0.1, 0.05, rng);
      const View view = MakeView(seen, truth, {.flipped_bits = 20, .clutter = 200}, rng);
      const Relocalization found =
          RelocalizeByPointsAndFocal(MakeFrame(view), f.mapped.map, f.index, {}, rng);
      ASSERT_TRUE(found.IsFound()) << focal << ' ' << angle << ": " << found.why_not;
      EXPECT_NEAR(found.camera->fx / focal, 1, 0.02) << angle;
      EXPECT_LT(found.focal_sigma, 0.01);
      EXPECT_LT(CenterDistance(found.cam_from_world, truth), 0.06) << focal;
    }
  }
}

TEST(RelocalizeByPointsAndFocal, RefusesAnotherWorld) {
  const PlaceWorld f;
  synthetic::WorldOptions other = synthetic::kPlaceWorld;
  other.seed = 78;
  Rng rng(1);
  const View view = MakeView(synthetic::MakeWorld(other), PoseOnArc({}, 0), {}, rng);
  EXPECT_FALSE(
      RelocalizeByPointsAndFocal(MakeFrame(view), f.mapped.map, f.index, {}, rng).IsFound());
}

}  // namespace
}  // namespace oaslam
