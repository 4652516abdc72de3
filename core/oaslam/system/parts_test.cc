#include "oaslam/map/parts.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "oaslam/objects/known_poses.h"
#include "oaslam/objects/occlusion.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/object_refinement.h"
#include "object_film.h"

namespace oaslam {
namespace {

using synthetic::TrueObject;
using synthetic::Upright;

constexpr int kHead = 100, kStatue = 101, kBase = 102, kArm = 103;
const ClassRelations kClasses{{{kHead, kStatue}, {kBase, kStatue}, {kArm, kStatue}}, {}};
const Camera& kStatueCamera = synthetic::kCamera;

// Five statues in a row that is not quite straight, each with parts such as an arm on one side.
std::vector<TrueObject> Statues(bool wholes, bool parts) {
  std::vector<TrueObject> objects;
  for (int i = 0; i < 5; ++i) {
    const double s = 1 + 0.15 * ((i * 3) % 5 - 2);
    const Eigen::Vector3d foot(0.45 * (i - 2), 0.15 * ((i * 2) % 3 - 1), 0);
    const auto add = [&](int category, const Eigen::Vector3d& center, const Eigen::Vector3d& axes) {
      objects.push_back(Upright(category, foot + s * center, s * axes));
    };
    if (wholes) add(kStatue, {0, 0, 0.25}, {0.1, 0.1, 0.25});
    if (!parts) continue;
    add(kHead, {0, 0.01, 0.43}, {0.05, 0.06, 0.07});
    add(kBase, {0, 0, 0.05}, {0.1, 0.1, 0.05});
    add(kArm, {i % 2 == 0 ? 0.08 : -0.08, -0.03, 0.26}, {0.04, 0.04, 0.1});
  }
  return objects;
}

Rigid3 Near(Rng& rng) {
  const double x = rng.Uniform(-0.6, 0.6);
  return synthetic::LookAt(
      {x + rng.Uniform(-0.2, 0.2), -rng.Uniform(0.7, 0.8), rng.Uniform(0.3, 0.5)},
      {x, 0, rng.Uniform(0.22, 0.3)});
}

// Maps the statues by a camera that moves along an arc of 70 degrees, about 2 m away.
Map MapStatues(const std::vector<TrueObject>& objects, const ClassRelations& classes) {
  Rng rng(1);
  std::vector<PosedDetections> film;
  for (int i = 0; i < 150; ++i) {
    const Rigid3 pose = synthetic::OnCircle(-std::numbers::pi / 2 + 1.2 * i / 150 - 0.6, 2.2);
    film.push_back({i, i / 30.0, pose,
                    synthetic::Detect(objects, pose, kStatueCamera, {.miss_rate = 0.1}, rng)});
  }
  return MapObjectsFromKnownPoses(film, kStatueCamera, {}, classes).map;
}

int CountMapped(const Map& map, int category_id) {
  int count = 0;
  map.objects.ForEach([&](ObjectId, const Object& o) {
    count += o.state == ObjectState::kMapped && o.category_id == category_id;
  });
  return count;
}

struct Found {
  int accepted = 0, right = 0;
};

// Relocalizes `queries` images taken from near by.
Found LocalizeNear(const Map& map, const std::vector<TrueObject>& seen, int queries) {
  Rng rng(4);
  Found found;
  for (int i = 0; i < queries; ++i) {
    const Rigid3 pose = Near(rng);
    const auto detections = synthetic::Detect(seen, pose, kStatueCamera, {.min_inside = 0.6}, rng);
    const auto candidates =
        RelocalizeByObjects(detections, kStatueCamera, map, {}, std::nullopt, rng);
    if (candidates.empty() || !candidates[0].IsFound()) continue;
    ++found.accepted;
    found.right += CenterDistance(candidates[0].cam_from_world, pose) < 0.05;
  }
  return found;
}

TEST(Parts, BecomeObjectsOfTheirOwnBesideTheirWholes) {
  const auto truth = Statues(true, true);
  const Map map = MapStatues(truth, kClasses);
  for (const int category : {kHead, kStatue, kBase, kArm})
    EXPECT_EQ(CountMapped(map, category), 5) << category;
  map.objects.ForEach([&](ObjectId id, const Object& o) {
    double error = 1;
    for (const TrueObject& t : truth)
      if (t.category_id == o.category_id)
        error = std::min(error, (t.ellipsoid.center - o.ellipsoid.center).norm());
    EXPECT_LT(error, 0.02);
    const auto whole = WholeOf(map, id);
    ASSERT_EQ(whole.has_value(), o.category_id != kStatue);
    if (whole) {
      EXPECT_NEAR(map.objects.At(*whole).ellipsoid.center.x(), o.ellipsoid.center.x(), 0.15);
    }
  });
}

TEST(Parts, ANearCameraThatSeesOnlyThemFindsItsPose) {
  const Map map = MapStatues(Statues(true, true), kClasses);
  const Found by_parts = LocalizeNear(map, Statues(false, true), 40);
  EXPECT_GE(by_parts.accepted, 32);
  EXPECT_GE(by_parts.right, by_parts.accepted - 1);
  const Found by_wholes =
      LocalizeNear(MapStatues(Statues(true, false), {}), Statues(true, false), 40);
  EXPECT_LT(by_wholes.accepted, by_parts.accepted / 2);  // two or three fit into the image
  const Found by_both = LocalizeNear(map, Statues(true, true), 40);
  EXPECT_GE(by_both.right, by_parts.right);
}

TEST(Parts, AreUsedTogetherWithWholesFromAfar) {
  const Map map = MapStatues(Statues(true, true), kClasses);
  Rng rng(2);
  const Rigid3 pose = synthetic::OnCircle(-1.8, 2);
  const auto detections = synthetic::Detect(Statues(true, true), pose, kStatueCamera, {}, rng);
  const auto candidates =
      RelocalizeByObjects(detections, kStatueCamera, map, {}, std::nullopt, rng);
  ASSERT_FALSE(candidates.empty());
  EXPECT_TRUE(candidates[0].IsFound());
  std::set<int> classes;
  for (const auto& [detection, object] : candidates[0].objects.matched)
    classes.insert(map.objects.At(object).category_id);
  EXPECT_TRUE(classes.contains(kStatue) && classes.contains(kHead));
}

TEST(Parts, AWholeIsNotMissedWhereItsPartsAreSeenNorTheOtherWayRound) {
  Map map = MapStatues(Statues(true, true), kClasses);
  Rng rng(2);
  const Rigid3 pose = synthetic::OnCircle(-1.8, 2);
  for (const bool wholes : {true, false}) {
    const auto detections =
        synthetic::Detect(Statues(wholes, !wholes), pose, kStatueCamera, {}, rng);
    const auto score = [&] {
      return RefineObjectPose(ObjectScene(detections, kStatueCamera, map, {}, std::nullopt), {pose})
          .objects.score;
    };
    map.classes = kClasses;
    const double related = score();
    map.classes = {};
    EXPECT_GT(related, score() + 3);
  }
}

TEST(Parts, HideNothingOfTheirWholeNorItOfThem) {
  // A long thing that points away from the camera, with a part at its far end.
  Map map = synthetic::EmptyMap();
  const TrueObject part = Upright(kHead, {0, 0, 4}, {0.12, 0.12, 0.12});
  synthetic::AddObject(map, MappedObject(Upright(kStatue, {0, 0, 3}, {0.3, 0.3, 1.2})));
  synthetic::AddObject(map, MappedObject(part));
  const ObjectId own(1);
  const auto hidden = [&] {
    std::vector<BoxView> views = {{Rigid3(), &map.cameras[0],
                                   *ProjectToBox(part.ellipsoid, Rigid3(), kStatueCamera), 0.9, 0}};
    MarkHiddenEdges(map, PlacesOf(map.objects), std::span(&own, 1), part.ellipsoid, views);
    return views[0].truncated;
  };
  EXPECT_NE(hidden(), 0);
  map.classes = kClasses;
  EXPECT_EQ(hidden(), 0);
  map.objects.MutableAt(ObjectId(0)).ellipsoid.center.z() = 1;  // another statue, in front
  map.objects.MutableAt(ObjectId(0)).ellipsoid.half_axes.z() = 0.3;
  EXPECT_NE(hidden(), 0);
}

}  // namespace
}  // namespace oaslam
