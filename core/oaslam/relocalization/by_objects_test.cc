#include "oaslam/relocalization/by_objects.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "oaslam/estimation/ellipsoid_residuals.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/util/rng.h"
#include "object_desk.h"

namespace oaslam {
namespace {

using namespace object_desk;

auto Locate(const std::vector<ObjectDetection>& detections, const Map& map, Rng& rng) {
  return RelocalizeByObjects(detections, kCamera, map, {}, std::nullopt, rng);
}

struct Shares {
  double found = 0, accepted = 0, wrong = 0;
};

Shares Measure(const Map& seen, const Map& known, bool with_gravity, int queries, double roll = 0) {
  Rng rng(5);
  Shares shares;
  for (int i = 0; i < queries; ++i) {
    const Query query = Photograph(seen, rng, 0.15, roll);
    std::optional<Eigen::Vector3d> gravity;
    if (with_gravity) gravity = query.cam_from_world.rotation * Eigen::Vector3d(-9.81 * kUp);
    const auto candidates = RelocalizeByObjects(query.detections, kCamera, known, {}, gravity, rng);
    if (candidates.empty()) continue;
    const double error = CenterDistance(candidates[0].cam_from_world, query.cam_from_world);
    shares.found += error < 0.1;
    shares.accepted += candidates[0].IsFound();
    shares.wrong += candidates[0].IsFound() && error > 0.3;
  }
  return {shares.found / queries, shares.accepted / queries, shares.wrong / queries};
}

TEST(RelocalizeByObjects, FindsTheCameraFromAllAround) {
  const Map map = Desk(1);
  const Shares vision = Measure(map, map, false, 40), gravity = Measure(map, map, true, 40);
  EXPECT_GE(vision.found, 0.9);
  EXPECT_GE(vision.accepted, 0.8);
  EXPECT_EQ(vision.wrong, 0);
  EXPECT_GE(gravity.found, 0.9);
  EXPECT_GE(gravity.accepted, vision.accepted);
  EXPECT_EQ(gravity.wrong, 0);
}

TEST(RelocalizeByObjects, HardlyEverAcceptsAWrongMap) {
  int accepted = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const Map map = Desk(seed);
    accepted += static_cast<int>(
        std::lround(20 * Measure(map, Permuted(map, seed + 10), false, 20).accepted));
  }
  EXPECT_LE(accepted, 2);  // of 80
}

TEST(RelocalizeByObjects, AFewObjectsOutOfPlaceAreOutvoted) {
  const Map map = Desk(1);
  Map disturbed = map;
  for (const uint32_t i : {1U, 5U, 9U, 12U})
    disturbed.objects.MutableAt(ObjectId(i)).ellipsoid.center += Eigen::Vector3d(0.06, -0.05, 0.03);
  Rng rng(8);
  std::vector<double> errors;
  for (int i = 0; i < 40; ++i) {
    const Query query = Photograph(map, rng, 0.05);
    const auto candidates = Locate(query.detections, disturbed, rng);
    errors.push_back(candidates.empty()
                         ? 1
                         : CenterDistance(candidates[0].cam_from_world, query.cam_from_world));
  }
  std::ranges::sort(errors);
  EXPECT_LT(errors[20], 0.03);
  EXPECT_LT(errors[34], 0.08);
}

TEST(RelocalizeByObjects, KnowsHowSureItIs) {
  const Map map = Desk(2);
  Rng rng(3);
  const Query query = Photograph(map, rng, 0);
  const auto all = Locate(query.detections, map, rng);
  ASSERT_FALSE(all.empty());
  EXPECT_TRUE(all[0].IsFound());
  EXPECT_GT(all[0].sigma_position(), 0);
  EXPECT_LT(CenterDistance(all[0].cam_from_world, query.cam_from_world),
            5 * all[0].sigma_position());
  for (size_t i = 1; i < all.size(); ++i) {
    EXPECT_FALSE(all[i].IsFound());
    EXPECT_LE(all[i].objects.score, all[i - 1].objects.score);
  }
  for (const auto& [detection, object] : all[0].objects.matched)
    EXPECT_EQ(query.detections[detection].category_id, map.objects.At(object).category_id);
  // Two objects are never enough, however well they fit.
  const std::vector<ObjectDetection> two(query.detections.begin(), query.detections.begin() + 2);
  for (const auto& candidate : Locate(two, map, rng)) EXPECT_FALSE(candidate.IsFound());
}

// A third of the labels are those of the next class. The second label tells the right one, by less.
TEST(RelocalizeByObjects, ConfusedLabelsAreOutweighed) {
  const Map map = Desk(1);
  std::set<int> classes;
  map.objects.ForEach([&](ObjectId, const Object& o) { classes.insert(o.category_id); });
  const auto next_class = [&](int category) {
    const auto next = classes.upper_bound(category);
    return next == classes.end() ? *classes.begin() : *next;
  };
  Rng rng(9);
  int found_by_one = 0, found_by_two = 0;
  for (int i = 0; i < 40; ++i) {
    Query query = Photograph(map, rng, 0);
    for (ObjectDetection& d : query.detections) {
      const int right = d.category_id, wrong = next_class(right);
      const bool is_confused = rng.Index(3) == 0;
      d.category_id = is_confused ? wrong : right;
      d.shares = {{right, is_confused ? 0.35 : 0.65}, {wrong, is_confused ? 0.65 : 0.35}};
      std::ranges::sort(d.shares, {}, &LabelShare::category_id);
    }
    const auto is_found = [&](const std::vector<ObjectDetection>& detections) {
      const auto all = Locate(detections, map, rng);
      const bool is_accepted = !all.empty() && all[0].IsFound();
      const bool is_right =
          is_accepted && CenterDistance(all[0].cam_from_world, query.cam_from_world) < 0.05;
      EXPECT_EQ(is_accepted, is_right);
      return is_right;
    };
    found_by_two += is_found(query.detections);
    for (ObjectDetection& d : query.detections) d.shares.clear();
    found_by_one += is_found(query.detections);
  }
  EXPECT_GT(found_by_two, found_by_one);
  EXPECT_GT(found_by_two, 20);
}

// See docs/objects.md. The mapping cameras are level here.
TEST(RelocalizeByObjects, ACameraThatIsRolledFurtherThanPeopleDoTakesGravity) {
  const Map map = Desk(1);
  EXPECT_GE(Measure(map, map, false, 20, 12 * kDegree).found, 0.8);
  EXPECT_GE(Measure(map, map, true, 20, 40 * kDegree).found, 0.8);
  EXPECT_EQ(Measure(map, map, false, 20, 90 * kDegree).found, 0);
  EXPECT_GE(Measure(map, map, true, 20, 90 * kDegree).found, 0.8);
  Map without_vertical = map;
  without_vertical.up.reset();
  EXPECT_GE(Measure(map, without_vertical, false, 20, 90 * kDegree).found, 0.8);
}

// The evidence that suffices is a setting; a pose that does not reach it must not
// end the search either.
TEST(RelocalizeByObjects, TheSearchGoesOnUntilItsEvidenceSuffices) {
  const Map map = Desk(2);
  RelocalizationConfig strict;
  strict.accept_evidence = 1e6;
  int searched_further = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const Query query = Photograph(map, rng, 0);
    const auto search = [&](const RelocalizationConfig& config) {
      Rng same(1);
      return RelocalizeByObjects(query.detections, kCamera, map, config, std::nullopt, same);
    };
    const auto usual = search({}), further = search(strict);
    ASSERT_FALSE(usual.empty());
    ASSERT_FALSE(further.empty());
    EXPECT_GE(further[0].objects.score, usual[0].objects.score);
    EXPECT_FALSE(further[0].IsFound());
    const auto same_pose = [](const Relocalization& a, const Relocalization& b) {
      return CenterDistance(a.cam_from_world, b.cam_from_world) == 0;
    };
    searched_further += !std::ranges::equal(usual, further, same_pose);
  }
  EXPECT_GE(searched_further, 3);
}

TEST(RelocalizeByObjects, NothingToGoBy) {
  const Map map = Desk(3);
  Rng rng(1);
  EXPECT_TRUE(Locate({}, map, rng).empty());
  const std::vector<ObjectDetection> unknown = {{77, 0.9, {10, 10, 90, 90}, 0}};
  EXPECT_TRUE(Locate(unknown, map, rng).empty());
  const std::vector<ObjectDetection> one = {{0, 0.9, {100, 100, 160, 160}, 0}};
  EXPECT_TRUE(Locate(one, Map(), rng).empty());
}

TEST(RelocalizeByObjects, WorksWithoutAKnownVertical) {
  Map map = Desk(4);
  map.up.reset();
  EXPECT_GE(Measure(map, map, false, 20).found, 0.8);
}

// 210 objects of 6 classes in a hall: fifteen desks, of which the query shows one.
// benchmarks/growth_benchmark.cc measures the time.
TEST(RelocalizeByObjects, OfManyDesksTheOneInViewIsFound) {
  Map map = Desk(5);
  const auto ids = map.objects.Ids();
  uint32_t next = 100;
  for (int desk = 1; desk < 15; ++desk)
    for (const ObjectId id : ids) {
      Object copy = map.objects.At(id);
      copy.ellipsoid.center += Eigen::Vector3d(4.0 * (desk % 4), 4.0 * (desk / 4), 0);
      copy.ellipsoid.center.head<2>() +=
          Eigen::Vector2d(0.13 * ((id.value * 7 + desk) % 5), 0.11 * ((id.value * 3 + desk) % 7));
      map.objects.Insert(ObjectId(next++), copy);
    }
  ASSERT_EQ(map.objects.size(), 210U);
  Rng rng(6);
  int found = 0;
  constexpr int kQueries = 5;
  for (int i = 0; i < kQueries; ++i) {
    const Query query = Photograph(Desk(5), rng);
    const auto candidates = Locate(query.detections, map, rng);
    if (candidates.empty() || !candidates[0].IsFound()) continue;
    EXPECT_LT(CenterDistance(candidates[0].cam_from_world, query.cam_from_world), 0.1) << i;
    ++found;
  }
  EXPECT_GE(found, kQueries - 1);
}

// Boxes whose sizes are wrong by a fifth in common, as of a detector that draws them tightly.
TEST(RelocalizeByObjects, MeasuredSurfacesTellTheDistance) {
  const Map map = Desk(1);
  Rng rng(8);
  double with = 0, without = 0;
  for (int i = 0; i < 15; ++i) {
    Query query = Photograph(map, rng, 0);
    for (ObjectDetection& d : query.detections) {
      const double x = .1 * d.box.Width(), y = .1 * d.box.Height();
      d.box = {d.box.x1 + x, d.box.y1 + y, d.box.x2 - x, d.box.y2 - y};
    }
    const auto error = [&] {
      const auto poses = Locate(query.detections, map, rng);
      return poses.empty() ? 1 : CenterDistance(poses[0].cam_from_world, query.cam_from_world);
    };
    without += error();
    for (ObjectDetection& d : query.detections) {
      double best = 1e9;
      map.objects.ForEach([&](ObjectId, const Object& object) {
        const auto view = ViewEllipsoid(object.ellipsoid, query.cam_from_world);
        if (!view || object.category_id != d.category_id) return;
        const Box box = OutlineBox(view->outline, kCamera);
        const double off = (CenterPixel(box) - CenterPixel(d.box)).norm();
        if (off > 8 || off > best) return;
        best = off;
        d.surface = SurfaceDepthOf(object.ellipsoid, query.cam_from_world).z;
      });
    }
    with += error();
  }
  EXPECT_LT(with, .7 * without);
}

}  // namespace
}  // namespace oaslam
