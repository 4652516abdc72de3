#include "oaslam/objects/object_merging.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/objects/own_landmarks.h"
#include "oaslam/util/rng.h"
#include "object_table.h"

namespace oaslam {
namespace {

using namespace object_table;

// Cup 0 mapped as two objects: from observations before frame `split` and after it.
Map SplitMap(bool really_two) {
  std::vector<TrueObject> objects = {TableTop()[0]};
  if (really_two)
    objects.push_back({41, {{-0.1, 0, 0.05}, {0.02, 0.02, 0.02}, Eigen::Quaterniond::Identity()}});
  Map map = EmptyMap();
  const auto features = std::make_shared<const Features>();
  const auto film = Film(objects, 200, {1, 0, 0}, 7);
  for (uint32_t k = 0; k < 200; ++k) {
    map.keyframes.Insert(
        KeyframeId(k),
        {static_cast<int>(k), k / 30.0, 0, film[k].cam_from_world, features, {}, {}});
    const size_t which = really_two ? 1 : 0;
    ObjectSighting first, second;
    first.object = ObjectId(0);
    second.object = ObjectId(1);
    first.category_id = second.category_id = 41;
    first.timestamp = second.timestamp = k / 30.0;
    first.is_new = k == 0;
    second.is_new = really_two ? k == 0 : k == 100;
    const auto observe = [&](size_t d) {
      return ObjectObservation{static_cast<int>(k),       KeyframeId(k), Rigid3(), 0,
                               film[k].detections[d].box, 0.8,           0};
    };
    first.observation = observe(0);
    second.observation = observe(which);
    std::vector<ObjectSighting> sightings;
    if (really_two || k < 100) sightings.push_back(first);
    if (really_two || k >= 100) sightings.push_back(second);
    UpdateObjects(map, sightings, {static_cast<int>(k), k / 30.0}, {});
  }
  return map;
}

TEST(Merging, OneObjectTrackedTwiceBecomesOne) {
  const Map map = SplitMap(false);
  EXPECT_EQ(map.objects.size(), 1U);
  ASSERT_TRUE(map.ResolveObject(ObjectId(1)));
  EXPECT_EQ(*map.ResolveObject(ObjectId(1)), ObjectId(0));
  EXPECT_EQ(map.objects.At(ObjectId(0)).total_observations, 200);
  EXPECT_EQ(map.objects.At(ObjectId(0)).state, ObjectState::kMapped);
}

// A book passed twice, half a minute apart, from two sides: each time too briefly to tell where it
// is, and tracked as two objects. `own` landmarks are on it.
Map PassedTwice(int own, const ObjectsConfig& config) {
  constexpr int kImages = 15, kPause = 900;
  const TrueObject book = TableTop()[2];
  Map map = EmptyMap();
  const auto features = std::make_shared<const Features>();
  std::vector<LandmarkId> landmarks;
  Rng rng(4);
  for (int i = 0; i < own; ++i)
    landmarks.push_back(map.AddLandmark(
        book.ellipsoid.center +
            0.05 * Eigen::Vector3d(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1)),
        KeyframeId(0)));
  for (int i = 0; i < 2 * kImages; ++i) {
    const bool again = i >= kImages;
    const int frame = again ? kPause + i : i;
    const double angle = 0.005 * i + (again ? 0.6 : 0);
    const Rigid3 pose = LookAt({1.4 * std::cos(angle), 1.4 * std::sin(angle), 0.7}, {0, 0, 0.05});
    const KeyframeId id(static_cast<uint32_t>(i));
    map.keyframes.Insert(id, {frame, frame / 30.0, 0, pose, features, {}, {}});
    ObjectSighting sighting;
    sighting.object = ObjectId(again);
    sighting.category_id = book.category_id;
    sighting.is_new = i % kImages == 0;
    sighting.timestamp = frame / 30.0;
    sighting.observation = {frame, id, Rigid3(), 0, *ProjectToBox(book.ellipsoid, pose, kCamera),
                            0.8,   0};
    sighting.landmarks = landmarks;
    UpdateObjects(map, std::span(&sighting, 1), {frame, frame / 30.0}, config);
  }
  return map;
}

TEST(Merging, WhatIsPassedTwiceBrieflyIsKnownByItsLandmarks) {
  const Map map = PassedTwice(15, {});
  ASSERT_EQ(map.objects.size(), 1U);
  const Object& book = map.objects.At(ObjectId(0));
  EXPECT_EQ(book.state, ObjectState::kMapped);
  EXPECT_LT((book.ellipsoid.center - TableTop()[2].ellipsoid.center).norm(), 0.02);
}

// Merges the first and the second half of the observations of a cup, which are two objects.
Map MergedHalves(const std::function<void(Object& early, Object& late)>& change) {
  Map map = SplitMap(false);
  Object early = map.objects.At(ObjectId(0)), late = early;
  early.observations.resize(early.observations.size() / 2);
  late.observations.erase(
      late.observations.begin(),
      late.observations.begin() + static_cast<std::ptrdiff_t>(early.observations.size()));
  change(early, late);
  map.merged_objects = {};
  map.objects.MutableAt(ObjectId(0)) = early;
  map.objects.Insert(ObjectId(1), late);
  MergeDuplicates(map, {ObjectId(0)}, {});
  return map;
}

TEST(Merging, AMappedObjectKeepsItsId) {
  const Map map =
      MergedHalves([](Object& early, Object&) { early.state = ObjectState::kInitialized; });
  EXPECT_FALSE(map.objects.Contains(ObjectId(0)));
  ASSERT_TRUE(map.objects.Contains(ObjectId(1)));
  EXPECT_EQ(map.objects.At(ObjectId(1)).state, ObjectState::kMapped);
  EXPECT_EQ(*map.ResolveObject(ObjectId(0)), ObjectId(1));
}

// What is seen from two sides at two times, as two ellipsoids that only touch, since each is off
// along the line of sight.
TEST(Merging, EllipsoidsThatTouchAreOneIfOneExplainsBoth) {
  for (const bool really_two : {false, true}) {
    const TrueObject cup = TableTop()[0];
    TrueObject other = cup;
    const double touching = 1.7 * cup.ellipsoid.half_axes.x();
    if (really_two) other.ellipsoid.center.y() += touching;
    Map map = EmptyMap();
    Object objects[2];
    for (int half = 0; half < 2; ++half) {
      Object& object = objects[half];
      const TrueObject& seen = half == 0 ? cup : other;
      object = MappedObject(seen);
      object.mean_iou = 0.9;
      if (half == 1 && !really_two) object.ellipsoid.center.x() += touching;
      for (int i = 0; i < 20; ++i) {
        const uint32_t k = static_cast<uint32_t>(20 * half + i);
        const double angle = 0.02 * i + 0.8 * half;
        const Rigid3 pose =
            LookAt({1.4 * std::cos(angle), 1.4 * std::sin(angle), 0.7}, {0, 0, 0.05});
        map.keyframes.Insert(
            KeyframeId(k),
            {static_cast<int>(k), k / 30.0, 0, pose, std::make_shared<const Features>(), {}, {}});
        object.observations.push_back({static_cast<int>(k), KeyframeId(k), Rigid3(), 0,
                                       *ProjectToBox(seen.ellipsoid, pose, kCamera), 0.8, 0});
      }
      object.total_observations = 20;
      map.objects.Insert(ObjectId(static_cast<uint32_t>(half)), object);
    }
    ASSERT_GT(IoU(BoundingBox(objects[0].ellipsoid), BoundingBox(objects[1].ellipsoid)), 0);
    ASSERT_LT(IoU(BoundingBox(objects[0].ellipsoid), BoundingBox(objects[1].ellipsoid)), 0.2);
    MergeDuplicates(map, {ObjectId(1)}, {});
    EXPECT_EQ(map.objects.size(), really_two ? 2U : 1U);
    if (!really_two) {
      EXPECT_LT((map.objects.At(ObjectId(0)).ellipsoid.center - cup.ellipsoid.center).norm(), 0.02);
    }
  }
}

// A thing that was taken for a bowl at first: both halves of its detections have both labels.
TEST(Merging, WhatIsGivenTwoLabelsBecomesOneOfTheCommonerClass) {
  for (const bool has_both : {true, false}) {
    const int category = TableTop()[0].category_id;
    const Map map = MergedHalves([&](Object& early, Object& late) {
      early.category_id = category + 1;
      early.total_observations = 10;
      late.total_observations = 30;
      if (!has_both) return;
      early.shares = {{category, 0.4}, {category + 1, 0.6}};
      late.shares = {{category, 0.8}, {category + 1, 0.2}};
    });
    ASSERT_EQ(map.objects.size(), has_both ? 1u : 2u);
    if (!has_both) continue;
    const Object& joint = map.objects.At(ObjectId(0));
    EXPECT_EQ(joint.category_id, category);
    EXPECT_NEAR(joint.shares.at(0).share, (0.4 * 10 + 0.8 * 30) / 40, 1e-12);
  }
}

TEST(Merging, WhatHasFewLandmarksIsForgottenAndSoDoesThePaper) {
  ObjectsConfig paper;
  paper.model = ObjectMethod::kPaper;
  for (const Map& map : {PassedTwice(5, {}), PassedTwice(15, paper)}) {
    EXPECT_FALSE(map.objects.Contains(ObjectId(0)));
    ASSERT_TRUE(map.objects.Contains(ObjectId(1)));  // the second pass, still in view
    EXPECT_EQ(map.objects.At(ObjectId(1)).state, ObjectState::kTentative);
  }
}

TEST(Merging, ObjectsSeenSideBySideStayTwo) {
  EXPECT_EQ(SplitMap(true).objects.size(), 2U);  // although one is inside the other
}

TEST(Merging, VotesAdd) {
  Object object;
  object.landmarks = {LandmarkId(1), LandmarkId(5)};
  object.landmark_votes = {2, 3};
  AddVotes({LandmarkId(0), LandmarkId(5), LandmarkId(9)}, {1, 1, 1}, object);
  EXPECT_EQ(object.landmarks,
            (std::vector{LandmarkId(0), LandmarkId(1), LandmarkId(5), LandmarkId(9)}));
  EXPECT_EQ(object.landmark_votes, (std::vector<uint16_t>{1, 2, 4, 1}));
}

}  // namespace
}  // namespace oaslam
