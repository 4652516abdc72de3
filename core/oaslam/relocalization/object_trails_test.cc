#include "oaslam/relocalization/object_trails.h"

#include <gtest/gtest.h>

#include <cmath>

#include "oaslam/relocalization/by_objects.h"
#include "object_desk.h"

namespace oaslam {
namespace {

using namespace object_desk;

constexpr double kInterval = 1.0 / 30;  // seconds
constexpr double kManyMissed = 0.7;     // share of the objects that a poor detector misses

// A camera that is carried around the desk.
Rigid3 PoseAt(double seconds, double start) {
  const double angle = start + 0.5 * seconds;
  return object_desk::LookAt({1.8 * std::cos(angle), 1.8 * std::sin(angle), 0.9 + 0.1 * seconds},
                             {0.1 * seconds, 0, 0});
}

struct Walk {
  int images = 0, accepted = 0, wrong = 0;
  int by_themselves = 0;  // images that are accepted without the others
};

Walk Follow(const Map& seen, const Map& known, double start, bool with_gravity = false) {
  Walk walk;
  Rng rng(7), search(1);
  ObjectTrails trails;
  for (; walk.images < 40; ++walk.images) {
    const double time = kInterval * walk.images;
    const Rigid3 pose = PoseAt(time, start);
    const auto detections = Detect(seen, pose, rng, kManyMissed);
    std::optional<Eigen::Vector3d> gravity;
    if (with_gravity) gravity = pose.rotation * Eigen::Vector3d(-kUp);
    const auto alone = RelocalizeByObjects(detections, kCamera, known, {}, gravity, search);
    walk.by_themselves += !alone.empty() && alone[0].IsFound();
    const auto found = trails.Follow(time, detections, kCamera, known, {}, gravity, search);
    if (found.empty() || !found[0].IsFound()) continue;
    ++walk.accepted;
    walk.wrong += CenterDistance(found[0].cam_from_world, pose) > 0.3;
  }
  return walk;
}

TEST(ObjectTrails, ManyImagesTellMoreThanEachByItself) {
  for (const bool with_gravity : {false, true}) {
    int accepted = 0, by_themselves = 0;
    for (const double start : {0.3, 2.0, 4.0}) {
      const Walk walk = Follow(Desk(1), Desk(1), start, with_gravity);
      accepted += walk.accepted;
      by_themselves += walk.by_themselves;
      EXPECT_EQ(walk.wrong, 0) << start;
    }
    EXPECT_GE(accepted, by_themselves + 10) << with_gravity;
  }
}

TEST(ObjectTrails, ARoomThatLooksAlikeIsAcceptedNoMoreThanByItself) {
  Walk all;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const Map map = Desk(seed);
    const Walk walk = Follow(map, Permuted(map, seed + 10), 0.3);
    all.accepted += walk.accepted;
    all.by_themselves += walk.by_themselves;
  }
  EXPECT_LE(all.accepted, std::max(all.by_themselves, 1));
}

TEST(ObjectTrails, TheFirstImageIsJudgedByItself) {
  const Map map = Desk(2);
  Rng rng(3);
  const auto detections = Detect(map, PoseAt(0, 1), rng, 0.1);
  Rng search(1), same_search(1);
  const auto alone = RelocalizeByObjects(detections, kCamera, map, {}, std::nullopt, search);
  ObjectTrails trails;
  const auto found = trails.Follow(5, detections, kCamera, map, {}, std::nullopt, same_search);
  ASSERT_EQ(found.size(), alone.size());
  EXPECT_EQ(found[0].IsFound(), alone[0].IsFound());
  EXPECT_DOUBLE_EQ(found[0].objects.score, alone[0].objects.score);
  EXPECT_DOUBLE_EQ(found[0].objects.margin, alone[0].objects.margin);
  EXPECT_EQ(CenterDistance(found[0].cam_from_world, alone[0].cam_from_world), 0);
}

TEST(ObjectTrails, ImagesOfLongAgoAreForgotten) {
  const Map map = Desk(2);
  Rng rng(3);
  const auto first = Detect(map, PoseAt(0, 1), rng, 0.1),
             second = Detect(map, PoseAt(0, 1), rng, 0.1);
  const auto score_after = [&](std::optional<double> gap) {
    Rng search(1);
    ObjectTrails trails;
    if (gap) trails.Follow(5 - *gap, first, kCamera, map, {}, std::nullopt, search);
    const auto nothing = trails.Follow(4.99, {}, kCamera, map, {}, std::nullopt, search);
    EXPECT_TRUE(nothing.empty());
    Rng same(2);
    return trails.Follow(5, second, kCamera, map, {}, std::nullopt, same).at(0).objects.score;
  };
  EXPECT_EQ(score_after(1.1), score_after(std::nullopt));
  EXPECT_NE(score_after(0.9), score_after(std::nullopt));
}

}  // namespace
}  // namespace oaslam
