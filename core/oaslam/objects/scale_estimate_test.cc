#include "oaslam/objects/scale_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "matchers.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/objects/known_poses.h"
#include "oaslam/objects/usual_sizes.h"
#include "object_film.h"

namespace oaslam {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

const Camera kScaleCamera = synthetic::World().camera;
const std::map<int, std::string> kScaleNames = {
    {0, "cup"},        {1, "bottle"}, {2, "book"},      {3, "keyboard"}, {4, "mouse"},
    {5, "cell phone"}, {6, "chair"},  {7, "microwave"}, {8, "giraffe"},  {9, "bowl"}};

// A thing of these sides, metres, that stands on a plane.
struct Thing {
  int category_id = 0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  Eigen::Vector3d sides = Eigen::Vector3d::Ones();
  double yaw = 0;
};

// Points of its surface, of which the box is drawn.
std::vector<Eigen::Vector3d> SurfaceOf(const Thing& thing, double table_height) {
  const UsualSize* size = FindUsualSize(kScaleNames.at(thing.category_id));
  const Solid solid = size ? size->solid : Solid::kBox;
  const Eigen::AngleAxisd turn(thing.yaw, Eigen::Vector3d::UnitZ());
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 64; ++i) {
    const double a = 2 * std::numbers::pi * i / 64;
    for (int j = -8; j <= 8; ++j) {
      Eigen::Vector3d unit(std::cos(a), std::sin(a), j / 8.0);
      if (solid == Solid::kBox) unit.head<2>() /= unit.head<2>().cwiseAbs().maxCoeff();
      if (solid == Solid::kBall) unit.head<2>() *= std::sqrt(1 - unit.z() * unit.z());
      const Eigen::Vector3d centre(thing.place.x(), thing.place.y(),
                                   table_height + thing.sides.z() / 2);
      points.push_back(centre + turn * (unit.cwiseProduct(thing.sides) / 2));
    }
  }
  return points;
}

Box BoxOf(const Thing& thing, double table_height, const Rigid3& cam_from_world) {
  constexpr double kFar = std::numeric_limits<double>::max();
  Box box{kFar, kFar, -kFar, -kFar};
  for (const Eigen::Vector3d& point : SurfaceOf(thing, table_height)) {
    const Eigen::Vector3d p = cam_from_world * point;
    const double x = kScaleCamera.fx * p.x() / p.z() + kScaleCamera.cx + .5,
                 y = kScaleCamera.fy * p.y() / p.z() + kScaleCamera.cy + .5;
    box = {std::min(box.x1, x), std::min(box.y1, y), std::max(box.x2, x), std::max(box.y2, y)};
  }
  return box;
}

// Things on a table, filmed from a part of a circle around it.
struct Room {
  std::vector<Thing> things;
  double table_height = .74, camera_height = 1.5, radius = 1.4;
};

Map MapOf(const Room& room) {
  Rng rng(5);
  std::vector<PosedDetections> film;
  for (int i = 0; i < 90; ++i) {
    const double angle = .03 * i;
    const Eigen::Vector3d eye(room.radius * std::cos(angle), room.radius * std::sin(angle),
                              room.camera_height + .02 * std::sin(.3 * i));
    PosedDetections frame{i, i / 30.0, synthetic::LookAt(eye, {0, 0, room.table_height + .05}), {}};
    for (const Thing& thing : room.things) {
      Box box = BoxOf(thing, room.table_height, frame.cam_from_world);
      for (double* edge : {&box.x1, &box.y1, &box.x2, &box.y2}) *edge += rng.Gaussian(1);
      frame.detections.push_back({thing.category_id, .8, box, 0});
    }
    film.push_back(std::move(frame));
  }
  return MapObjectsFromKnownPoses(film, kScaleCamera, {}, {}).map;
}

// Things of usual sizes, times a factor.
std::vector<Thing> Desk(double times = 1) {
  std::vector<Thing> things = {
      {0, {.25, .20}, {.115, .085, .095}},   {0, {-.35, .05}, {.12, .08, .085}, 1},
      {1, {.05, .35}, {.07, .07, .25}},      {2, {-.10, .20}, {.23, .155, .025}, .5},
      {3, {0, -.12}, {.44, .15, .025}, .1},  {4, {.33, -.12}, {.112, .063, .038}, 1.4},
      {7, {-.45, .45}, {.50, .38, .29}, .2}, {9, {.5, .35}, {.155, .155, .062}}};
  for (Thing& thing : things) {
    thing.sides *= times;
    thing.place *= times;
  }
  return things;
}

double Error(const ScaleEstimate& estimate, double truth = 1) {
  return std::log(estimate.metres_per_unit / truth) / estimate.relative_sigma;
}

// Only the objects of these classes.
Map WithClasses(Map map, const std::vector<int>& classes) {
  for (const ObjectId id : map.objects.Ids())
    if (std::ranges::find(classes, map.objects.At(id).category_id) == classes.end())
      map.objects.Erase(id);
  return map;
}

void Resize(const std::vector<int>& classes, double times, Map& map) {
  for (const ObjectId id : map.objects.Ids())
    if (std::ranges::find(classes, map.objects.At(id).category_id) != classes.end())
      map.objects.MutableAt(id).ellipsoid.half_axes *= times;
}

class ScaleEstimateTest : public testing::Test {
 protected:
  ScaleEstimate Estimate(const Map& map) const { return EstimateScale(map, kScaleNames); }

  static const Map& DeskMap() {
    static const Map map = MapOf({Desk()});
    return map;
  }
};

TEST_F(ScaleEstimateTest, ThingsOfUsualSizesTellTheUnit) {
  const ScaleEstimate estimate = Estimate(DeskMap());
  ASSERT_TRUE(estimate.success) << estimate.why_not;
  EXPECT_THAT(estimate.why_not, IsEmpty());
  EXPECT_LT(std::abs(Error(estimate)), 1) << estimate.metres_per_unit;
  EXPECT_EQ(estimate.objects, 8);
  EXPECT_EQ(estimate.classes, 7);
  EXPECT_GT(estimate.relative_sigma, .04);
  EXPECT_LT(estimate.relative_sigma, .10);
}

TEST_F(ScaleEstimateTest, FollowsTheUnitOfTheMap) {
  const ScaleEstimate before = Estimate(DeskMap());
  for (const double factor : {.01, .4, 30.0}) {
    Map map = DeskMap();
    map.Scale(factor);
    const ScaleEstimate after = Estimate(map);
    ASSERT_TRUE(after.success) << after.why_not;
    EXPECT_NEAR(after.metres_per_unit * factor, before.metres_per_unit, .01);
    EXPECT_NEAR(after.relative_sigma, before.relative_sigma, .002);
  }
}

TEST_F(ScaleEstimateTest, TakesThreeObjectsOfThreeClasses) {
  EXPECT_THAT(
      Estimate(WithClasses(DeskMap(), {0, 1})).why_not,
      HasSubstr("3 objects of 2 classes have a usual size, it takes 3 objects of 3 classes"));
  EXPECT_THAT(Estimate(WithClasses(DeskMap(), {1})).why_not, HasSubstr("1 object of 1 class"));
  EXPECT_THAT(Estimate(WithClasses(DeskMap(), {})).why_not, HasSubstr("0 objects of 0 classes"));
  const ScaleEstimate three = Estimate(WithClasses(DeskMap(), {1, 3, 7}));
  EXPECT_TRUE(three.success) << three.why_not;
  EXPECT_GT(three.relative_sigma, Estimate(DeskMap()).relative_sigma);
}

TEST_F(ScaleEstimateTest, ManyThingsOfOneClassAreHardlyMoreThanOneWitness) {
  std::vector<Thing> cups = {{1, {0, .3}, {.07, .07, .25}}, {3, {0, -.12}, {.44, .15, .025}}};
  for (int i = 0; i < 8; ++i) cups.push_back({0, {-.6 + .17 * i, .1}, {.115, .085, .095}});
  const ScaleEstimate many = Estimate(MapOf({cups}));
  cups.resize(3);
  const ScaleEstimate one = Estimate(MapOf({cups}));
  ASSERT_TRUE(many.success && one.success) << many.why_not << one.why_not;
  EXPECT_LT(many.relative_sigma, one.relative_sigma);
  EXPECT_GT(many.relative_sigma, .8 * one.relative_sigma);
}

TEST_F(ScaleEstimateTest, NeedsTheVertical) {
  Map map = DeskMap();
  map.up.reset();
  EXPECT_THAT(Estimate(map).why_not, HasSubstr("vertical"));
}

TEST_F(ScaleEstimateTest, AWrongLabelIsOutvoted) {
  Map map = DeskMap();
  Resize({4}, 2.3, map);
  const ScaleEstimate estimate = Estimate(map);
  ASSERT_TRUE(estimate.success) << estimate.why_not;
  EXPECT_EQ(estimate.classes, 6);
  EXPECT_LT(std::abs(Error(estimate)), 1.5);
}

TEST_F(ScaleEstimateTest, ClassesThatDisagreeAreNotBelieved) {
  Map map = DeskMap();
  Resize({0, 3, 4}, .5, map);  // toys among real things
  const ScaleEstimate estimate = Estimate(map);
  EXPECT_FALSE(estimate.success);
  EXPECT_THAT(estimate.why_not, HasSubstr("disagree"));
  Resize({0, 3}, 2, map);  // one class of toys is no reason
  EXPECT_TRUE(Estimate(map).success) << Estimate(map).why_not;
}

TEST_F(ScaleEstimateTest, ThingsWithoutAUsualSizeSayNothing) {
  std::vector<Thing> things = Desk();
  things.push_back({8, {.45, 0}, {.1, .1, .3}});  // a giraffe
  const ScaleEstimate estimate = Estimate(MapOf({things}));
  EXPECT_EQ(estimate.objects, 8);
  EXPECT_LT(std::abs(Error(estimate)), 1);
}

// Adds landmarks at these heights, which all keyframes see. `side`: of the room.
Map WithLandmarksAt(const std::vector<double>& heights, Map map, double side = 4) {
  Rng rng(1);
  for (const double height : heights) {
    const auto id = LandmarkId(static_cast<uint32_t>(map.landmarks.size()));
    Landmark landmark;
    landmark.position = {side * rng.Uniform(-.5, .5), side * rng.Uniform(-.5, .5), height};
    map.landmarks.Insert(id, landmark);
    for (const KeyframeId keyframe : map.keyframes.Ids())
      map.keyframes.MutableAt(keyframe).landmarks.push_back(id);
  }
  return map;
}

std::vector<double> Scattered(int count, double low, double high) {
  Rng rng(2);
  std::vector<double> heights;
  for (int i = 0; i < count; ++i) heights.push_back(rng.Uniform(low, high));
  return heights;
}

// The floor as the landmarks of a room show it.
Map OnAFloor(Map map) {
  return WithLandmarksAt(Scattered(1500, 0, 1),
                         WithLandmarksAt(std::vector<double>(500, 0), std::move(map)));
}

// The same room, with another storey below that no keyframe at the desk sees.
Map InTheUpperStorey(Map map) {
  for (uint32_t i = 10000; i < 10400; ++i) {
    Landmark landmark;
    landmark.position = {0, 0, i % 4 ? -2 : -2.7};
    map.landmarks.Insert(LandmarkId(i), landmark);
  }
  return map;
}

// By itself a desk of models looks like a desk; but nobody holds a camera so high above it.
TEST_F(ScaleEstimateTest, ModelsFilmedByAPersonAreOdd) {
  const Map desk = OnAFloor(DeskMap());
  EXPECT_TRUE(Estimate(desk).success) << Estimate(desk).why_not;
  EXPECT_TRUE(Estimate(InTheUpperStorey(desk)).success) << Estimate(InTheUpperStorey(desk)).why_not;
  const Map models = MapOf({Desk(.5), .37, 1.5, 1.4});
  EXPECT_TRUE(Estimate(models).success);
  EXPECT_LT(std::abs(Error(Estimate(models), 2)), 1.5);
  const ScaleEstimate odd = Estimate(OnAFloor(models));
  EXPECT_FALSE(odd.success);
  EXPECT_THAT(odd.why_not, HasSubstr("above the floor"));
}

TEST_F(ScaleEstimateTest, TheFloorIsALevelAndNotTheLowestLandmark) {
  const Map desk = OnAFloor(DeskMap()), models = OnAFloor(MapOf({Desk(.5), .37, 1.5, 1.4}));
  const std::vector<double> wrong = Scattered(120, -6, -.3),  // triangulated from wrong matches
      mirrored = Scattered(120, -2.5, -.05),                  // in a polished floor
      beside_a_bridge = Scattered(60, -20, -3);
  for (const std::vector<double>& below : {wrong, mirrored, beside_a_bridge}) {
    const ScaleEstimate estimate = Estimate(WithLandmarksAt(below, desk));
    EXPECT_TRUE(estimate.success) << estimate.why_not;
    EXPECT_THAT(Estimate(WithLandmarksAt(below, models)).why_not, HasSubstr("above the floor"));
  }
}

// A tilt of 15 degrees lowers the far side of a hall by more than a metre.
TEST_F(ScaleEstimateTest, TheFloorOfATiltedVerticalIsFound) {
  const auto tilted = [](const Map& room, double towards) {
    Map map = WithLandmarksAt(std::vector<double>(500, 0),
                              WithLandmarksAt(Scattered(1500, 0, 1), room, 12), 12);
    const Eigen::Vector3d axis(std::cos(towards), std::sin(towards), 0);
    map.up = Eigen::AngleAxisd(.26, axis) * *map.up;
    return map;
  };
  const Map models = MapOf({Desk(.5), .37, 1.5, 1.4});
  for (const double towards : {0., 1.5, 3.5}) {
    const ScaleEstimate estimate = Estimate(tilted(DeskMap(), towards));
    EXPECT_TRUE(estimate.success) << estimate.why_not;
    EXPECT_THAT(Estimate(tilted(models, towards)).why_not, HasSubstr("above the floor"));
  }
}

// Models on a table: most landmarks are on the table, and few on the floor.
TEST_F(ScaleEstimateTest, AFloorOfFewLandmarksIsAFloor) {
  const Map table = WithLandmarksAt(Scattered(385, .74, .8), DeskMap());
  EXPECT_TRUE(Estimate(table).success) << Estimate(table).why_not;
  const Map floor = WithLandmarksAt(Scattered(15, -1.55, -1.5), table);
  EXPECT_THAT(Estimate(floor).why_not, HasSubstr("above the floor"));
}

// Two units that differ by half fit into one wide answer between them.
TEST_F(ScaleEstimateTest, TwoUnitsThatAreNearAreNotOneAnswer) {
  const auto resized = [](Map map, const std::vector<int>& classes, double times) {
    Resize(classes, times, map);
    return map;
  };
  const Map four = WithClasses(DeskMap(), {0, 3, 4, 7});
  for (const Map& two_units :
       {resized(four, {4, 7}, 1.6), resized(four, {0}, 1.5), resized(DeskMap(), {4, 7}, 1.5)})
    EXPECT_THAT(Estimate(two_units).why_not, HasSubstr("more than one unit"));
  const ScaleEstimate alike = Estimate(resized(four, {4, 7}, 1.2));
  EXPECT_TRUE(alike.success) << alike.why_not;
}

// In households whose things differ from the usual sizes as the table says.
TEST_F(ScaleEstimateTest, TheSigmaIsTrue) {
  Rng rng(7);
  const double offset = std::log(Estimate(DeskMap()).metres_per_unit);
  int within_one = 0, within_two = 0, told = 0;
  constexpr int kHouseholds = 200;
  for (int i = 0; i < kHouseholds; ++i) {
    Map map = DeskMap();
    const double detector = rng.Gaussian(.05);
    std::map<int, double> of_class;
    for (const ObjectId id : map.objects.Ids()) {
      Object& object = map.objects.MutableAt(id);
      const UsualSize& size = *FindUsualSize(kScaleNames.at(object.category_id));
      const double sigma = (size.length.LogSigma() + size.height.LogSigma()) / 2;
      const auto [common, is_new] = of_class.try_emplace(object.category_id, 0);
      if (is_new) common->second = rng.Gaussian(sigma * std::sqrt(.5));
      object.ellipsoid.half_axes *=
          std::exp(detector + common->second + rng.Gaussian(sigma * std::sqrt(.5)));
    }
    const ScaleEstimate estimate = Estimate(map);
    if (!estimate.success) continue;
    ++told;
    const double error =
        std::abs(std::log(estimate.metres_per_unit) - offset) / estimate.relative_sigma;
    within_one += error < 1;
    within_two += error < 2;
  }
  EXPECT_GT(told, .9 * kHouseholds);
  EXPECT_GT(within_one, .55 * told);
  EXPECT_LT(within_one, .85 * told);
  EXPECT_GT(within_two, .9 * told);
}

TEST(ContradictionOfUnit, IsSaidBeyondThreeSigmas) {
  ScaleEstimate estimate{true, "", .5, .08, 6, 4};
  EXPECT_THAT(ContradictionOfUnit(estimate),
              HasSubstr("6 objects of 4 classes a metre of it is 0.50 +- 0.04 m"));
  estimate.metres_per_unit = 1.2;
  EXPECT_THAT(ContradictionOfUnit(estimate), IsEmpty());
  EXPECT_THAT(ContradictionOfUnit({}), IsEmpty());
}

TEST(UsualSizes, HoldWhatManyHave) {
  const auto holds = [](const char* name, double length, double depth, double height) {
    const UsualSize& size = *FindUsualSize(name);
    const auto within = [](const UsualRange& range, double metres) {
      return range.least <= metres && metres <= range.most;
    };
    return within(size.length, length) && within(size.depth, depth) && within(size.height, height);
  };
  EXPECT_TRUE(holds("keyboard", .440, .135, .035));   // with a number pad
  EXPECT_TRUE(holds("keyboard", .355, .130, .030));   // without
  EXPECT_TRUE(holds("keyboard", .285, .115, .012));   // compact, as for tablets
  EXPECT_FALSE(holds("keyboard", .240, .090, .012));  // folded
}

TEST(UsualSizes, AreRangesOfSolids) {
  for (const char* name : {"cup", "book", "door", "car", "sofa"}) {
    const UsualSize* size = FindUsualSize(name);
    ASSERT_TRUE(size) << name;
    for (const UsualRange& range : {size->length, size->depth, size->height}) {
      EXPECT_LT(0, range.least) << name;
      EXPECT_LT(range.least, range.most) << name;
      EXPECT_GT(range.Median(), range.least);
      EXPECT_LT(range.LogSigma(), 1) << name;
    }
  }
  EXPECT_EQ(FindUsualSize("sofa"), FindUsualSize("couch"));
  EXPECT_FALSE(FindUsualSize("potted plant"));
  EXPECT_FALSE(FindUsualSize(""));
}

}  // namespace
}  // namespace oaslam
