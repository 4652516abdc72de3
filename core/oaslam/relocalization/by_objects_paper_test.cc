#include "oaslam/relocalization/by_objects_paper.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "object_film.h"

namespace oaslam {
namespace {

// Balls, which look the same from all sides, on a desk of 1.6 m x 1.2 m.
Map BallDesk(int objects, int classes) {
  Rng rng(4);
  Map map = synthetic::EmptyMap();
  for (int i = 0; i < objects; ++i) {
    const double size = 0.04 + 0.01 * (i % 5);
    const Eigen::Vector3d center{rng.Uniform(-0.8, 0.8), rng.Uniform(-0.6, 0.6), size};
    synthetic::AddObject(map, MappedObject(synthetic::Upright(i % classes, center,
                                                              Eigen::Vector3d::Constant(size))));
  }
  return map;
}

Rigid3 PoseAround(int i) {
  const double angle = 2 * std::numbers::pi * i / 10;
  return synthetic::LookAt({2 * std::cos(angle), 2 * std::sin(angle), 1}, {0, 0, 0});
}

std::vector<ObjectDetection> PhotographBalls(const Map& map, const Rigid3& cam_from_world) {
  std::vector<ObjectDetection> detections;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (const auto box = ProjectToBox(object.ellipsoid, cam_from_world, synthetic::kCamera))
      detections.push_back({object.category_id, 0.9, *box, 0});
  });
  return detections;
}

auto FindAsInPaper(std::span<const ObjectDetection> detections, const Map& map, Rng& rng) {
  return RelocalizeByObjectsAsInPaper(detections, synthetic::kCamera, map, {}, rng);
}

TEST(RelocalizeByObjectsAsInPaper, FindsTheCameraFromAllAround) {
  const Map map = BallDesk(12, 5);
  Rng rng(1);
  for (int i = 0; i < 10; ++i) {
    const Rigid3 truth = PoseAround(i);
    const auto found = FindAsInPaper(PhotographBalls(map, truth), map, rng);
    ASSERT_FALSE(found.empty());
    EXPECT_TRUE(found[0].IsFound());
    EXPECT_GT(found[0].objects.matched.size(), 10u);
    // The centre of a box is not quite where the centre of the object is seen.
    EXPECT_LT(CenterDistance(found[0].cam_from_world, truth), 0.05);
  }
}

TEST(RelocalizeByObjectsAsInPaper, ScoreIsTheSumOfOverlaps) {
  const Map map = BallDesk(12, 3);
  std::vector<ObjectDetection> detections = PhotographBalls(map, PoseAround(3));
  for (size_t i = 0; i < detections.size(); ++i)
    detections[i].box.x2 += 3.0 * static_cast<double>(i % 3);
  detections.push_back({1, 0.8, {20, 20, 90, 60}, 0});  // shows no mapped object
  Rng rng(1);
  const auto found = FindAsInPaper(detections, map, rng);
  ASSERT_GT(found.size(), 1u);
  for (size_t i = 0; i < found.size(); ++i) {
    double sum = 0;
    std::set<int> used_detections;
    std::set<uint32_t> used_objects;
    for (const auto& [d, id] : found[i].objects.matched) {
      const Object& object = map.objects.At(id);
      EXPECT_EQ(detections[d].category_id, object.category_id);
      EXPECT_TRUE(used_detections.insert(d).second);
      EXPECT_TRUE(used_objects.insert(id.value).second);
      sum += IoU(*ProjectToBox(object.ellipsoid, found[i].cam_from_world, synthetic::kCamera),
                 detections[d].box);
    }
    EXPECT_NEAR(found[i].objects.score, sum, 1e-9);
    EXPECT_EQ(found[i].IsFound(), i == 0);
    EXPECT_LE(found[i].objects.score, found[0].objects.score);
  }
  EXPECT_NEAR(found[0].objects.margin, found[0].objects.score - found[1].objects.score, 1e-9);
}

TEST(RelocalizeByObjectsAsInPaper, AcceptsAWrongMapToo) {
  const Map map = BallDesk(12, 5);
  Map wrong = map;
  for (uint32_t i = 0; i < 12; ++i)
    wrong.objects.MutableAt(ObjectId(i)).ellipsoid.center =
        map.objects.At(ObjectId((i + 1) % 12)).ellipsoid.center;
  Rng rng(1);
  const Rigid3 truth = PoseAround(0);
  const auto found = FindAsInPaper(PhotographBalls(map, truth), wrong, rng);
  ASSERT_FALSE(found.empty());
  EXPECT_TRUE(found[0].IsFound());
  EXPECT_GT(CenterDistance(found[0].cam_from_world, truth), 0.2);
}

TEST(RelocalizeByObjectsAsInPaper, NeedsThreeDetectionsOfThreeObjects) {
  const Map map = BallDesk(12, 5);
  Rng rng(1);
  std::vector<ObjectDetection> detections = PhotographBalls(map, PoseAround(0));
  EXPECT_TRUE(FindAsInPaper({}, map, rng).empty());
  EXPECT_TRUE(FindAsInPaper(std::span(detections).first(2), map, rng).empty());
  EXPECT_FALSE(FindAsInPaper(std::span(detections).first(3), map, rng).empty());
  const Map two = BallDesk(2, 1);
  for (ObjectDetection& d : detections) d.category_id = 0;
  EXPECT_TRUE(FindAsInPaper(detections, two, rng).empty());
}

// 24 boxes and 200 objects of one class have 1.6e10 triplets, which would take days.
TEST(RelocalizeByObjectsAsInPaper, TriesABoundedNumberOfTripletsTheSameOnEveryRun) {
  const Map map = BallDesk(200, 1);
  std::vector<ObjectDetection> detections = PhotographBalls(map, PoseAround(0));
  detections.resize(24);
  Rng first(3), second(3);
  const auto a = FindAsInPaper(detections, map, first), b = FindAsInPaper(detections, map, second);
  ASSERT_FALSE(a.empty());
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].objects.score, b[i].objects.score);
    EXPECT_EQ(a[i].cam_from_world.translation, b[i].cam_from_world.translation);
  }
}

}  // namespace
}  // namespace oaslam
