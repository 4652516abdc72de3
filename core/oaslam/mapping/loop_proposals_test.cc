#include "oaslam/mapping/loop_proposals.h"

#include <gtest/gtest.h>

#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/mapping/loop_closing.h"
#include "object_film.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr uint32_t kPass = 18;  // keyframes
constexpr uint32_t kMinApart = 15;

struct Thing {
  int category;
  Eigen::Vector3d center;
};

const std::vector<Thing> kRoom = {{1, {-1.2, 0.2, -0.5}}, {1, {-0.7, -0.6, -0.5}},
                                  {2, {-0.1, 0.4, -0.2}}, {3, {0.5, -0.3, -0.4}},
                                  {1, {0.9, 0.5, -0.5}},  {4, {1.1, -0.2, 0.4}}};

// A room seen twice: by a camera on one side and, later, by one on the other side of it. What was
// mapped in the second pass is displaced by drift, and has landmarks and objects of its own.
struct SecondPass {
  Map map;
  std::vector<Rigid3> truth;
  Similarity old_from_current;

  // `common`: the share of points that both sides show. The other ones look different.
  SecondPass(const Similarity& current_from_old, double common)
      : old_from_current(current_from_old.Inverse()) {
    synthetic::World world = synthetic::MakeWorld({.cameras = 0});
    for (const double side : {-25.0, 25.0})
      for (uint32_t k = 0; k < kPass; ++k)
        truth.push_back(synthetic::PoseOnArc({}, side + 30.0 * (k / (kPass - 1.0) - 0.5)));
    world.cam_from_world = truth;
    map = synthetic::MakeMap(world, {}).map;
    map.up = Eigen::Vector3d::UnitZ();
    Rng rng(5);
    for (const LandmarkId id : map.landmarks.Ids()) {
      const bool is_common = rng.Uniform(0, 1) < common;
      const Descriptor other_side = synthetic::RandomDescriptor(rng);
      const std::vector<Observation> late = synthetic::TakeObservations(map, id, kPass);
      if (late.size() < 2) continue;
      const LandmarkId twin = map.AddLandmark({}, late.front().keyframe);
      Eigen::Vector3d position =
          map.landmarks.Contains(id) ? map.landmarks.At(id).position : Eigen::Vector3d(0, 0, 0);
      map.landmarks.MutableAt(twin).position = current_from_old * position;
      for (const Observation& o : late) {
        map.AddObservation(twin, o.keyframe, o.keypoint);
        if (is_common) continue;
        Keyframe& keyframe = map.keyframes.MutableAt(o.keyframe);
        auto features = std::make_shared<Features>(*keyframe.features);
        features->descriptors[o.keypoint] = other_side;
        keyframe.features = features;
      }
    }
    for (uint32_t k = kPass; k < 2 * kPass; ++k) {
      Rigid3& pose = map.keyframes.MutableAt(KeyframeId(k)).cam_from_world;
      pose = (Similarity(pose) * old_from_current).AsPose();
    }
    for (const LandmarkId id : map.landmarks.Ids()) map.UpdateLandmark(id);
    for (uint32_t k = 0; k < 2 * kPass; ++k) map.UpdateCovisibility(KeyframeId(k));
  }

  // A thing of the second pass comes to lie so far from its place.
  double ErrorOf(const LoopProposal& proposal, const Thing& thing) const {
    return (proposal.old_from_current * (old_from_current.Inverse() * thing.center) - thing.center)
        .norm();
  }

  KeyframeId current() const { return KeyframeId(2 * kPass - 3); }  // 33, a multiple of three

  // Things as mapped in one of the passes.
  void Add(const std::vector<Thing>& things, bool in_second) {
    for (const Thing& thing : things) {
      const double radius = 0.12 + 0.01 * thing.category;
      Object object = synthetic::MappedObject(
          synthetic::Upright(thing.category, thing.center, {radius, radius, 0.1}));
      if (in_second) {
        object.ellipsoid.center = old_from_current.Inverse() * object.ellipsoid.center;
        object.ellipsoid.half_axes /= old_from_current.scale;
      }
      for (uint32_t k = in_second ? kPass : 0; k < (in_second ? 2 * kPass : kPass); ++k)
        if (const auto box = ProjectToBox(
                object.ellipsoid, map.keyframes.At(KeyframeId(k)).cam_from_world, map.cameras[0]))
          object.observations.push_back(
              {map.keyframes.At(KeyframeId(k)).frame_index, KeyframeId(k), {}, 0, *box});
      synthetic::AddObject(map, object);
    }
  }
};

Similarity Drift(double scale, double turn, const Eigen::Vector3d& shift) {
  return {scale, Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ())), shift};
}

TEST(LoopProposals, FindsThingsThatWereMappedTwice) {
  for (const bool knows_vertical : {true, false}) {
    SecondPass pass(Drift(1.2, 0.3, {0.5, 0.3, 0.1}), 0);
    if (!knows_vertical) pass.map.up.reset();
    pass.Add(kRoom, false);
    pass.Add(kRoom, true);
    const auto proposal = LoopProposals().Find(pass.map, pass.current(), kMinApart);
    ASSERT_TRUE(proposal) << knows_vertical;
    EXPECT_EQ(proposal->old_objects.size(), kRoom.size());
    EXPECT_NEAR(proposal->old_from_current.scale, 1 / 1.2, 1e-6);
    for (const Thing& thing : kRoom) EXPECT_LT(pass.ErrorOf(*proposal, thing), 1e-6);
  }
}

TEST(LoopProposals, ErrorsOfTheModelsAndMissingThingsDoNotMatter) {
  SecondPass pass(Drift(0.9, -0.2, {-0.6, 0.2, 0}), 0);
  pass.Add(kRoom, false);
  std::vector<Thing> again(kRoom.begin(), kRoom.end() - 1);
  again.push_back({7, {0.2, 0.8, -0.5}});
  Rng rng(3);
  for (Thing& thing : again)
    for (int i = 0; i < 3; ++i) thing.center[i] += rng.Gaussian(0.02);
  pass.Add(again, true);
  const auto proposal = LoopProposals().Find(pass.map, pass.current(), kMinApart);
  ASSERT_TRUE(proposal);
  EXPECT_GE(proposal->old_objects.size(), 4U);
  for (const Thing& thing : kRoom) EXPECT_LT(pass.ErrorOf(*proposal, thing), 0.12);
}

TEST(LoopProposals, OtherArrangementsAreNotProposed) {
  std::vector<Thing> permuted = kRoom, turned = kRoom, chairs = kRoom;
  for (size_t i = 0; i < kRoom.size(); ++i) {
    permuted[i].category = kRoom[(i + 2) % kRoom.size()].category;
    turned[i].center = Drift(1, 1.5, {0, 0, 0}) * kRoom[i].center;  // drift does not turn so far
    chairs[i].category = 1;                                         // of one class: a row of chairs
  }
  for (const auto& [first, second] :
       {std::pair(kRoom, permuted), std::pair(kRoom, turned), std::pair(chairs, chairs)}) {
    SecondPass pass(Drift(1, 0, {0.5, 0, 0}), 0);
    pass.Add(first, false);
    pass.Add(second, true);
    EXPECT_FALSE(LoopProposals().Find(pass.map, pass.current(), kMinApart));
  }
}

TEST(LoopProposals, FollowsTheChangesOfTheMap) {
  SecondPass pass(Drift(1, 0, {0.5, 0, 0}), 0);
  pass.Add(kRoom, false);
  LoopProposals proposals;
  EXPECT_FALSE(proposals.Find(pass.map, pass.current(), kMinApart));
  pass.Add(kRoom, true);
  EXPECT_TRUE(proposals.Find(pass.map, pass.current(), kMinApart));
  for (const ObjectId id : pass.map.objects.Ids())
    if (id.value < 3) pass.map.objects.Erase(id);
  EXPECT_FALSE(proposals.Find(pass.map, pass.current(), kMinApart));
}

// From the other side most points look different: too few are left for a loop by points alone.
TEST(LoopProposals, ALoopIsClosedByThingsAndFewPoints) {
  for (const bool has_things : {false, true}) {
    SecondPass pass(Drift(1.1, 0.1, {0.4, 0.2, 0.1}), 0.08);
    if (has_things) pass.Add(kRoom, false);
    if (has_things) pass.Add(kRoom, true);
    ASSERT_TRUE(pass.map.CheckInvariants().empty());
    Rng rng(1);
    const auto loop = LoopDetector().Detect(pass.map, pass.current(), rng);
    ASSERT_EQ(loop.has_value(), has_things);
    if (!loop) continue;
    EXPECT_LT(loop->old.value, kPass);
    EXPECT_GE(loop->old_landmarks.size(), 25U);
    EXPECT_LT(loop->old_landmarks.size(), 50U);
    ASSERT_TRUE(CorrectLoop(*loop, pass.map));
    EXPECT_TRUE(pass.map.CheckInvariants().empty());
    EXPECT_LT(CenterDistance(pass.map.keyframes.At(pass.current()).cam_from_world,
                             pass.truth[pass.current().value]),
              0.03);
  }
}

TEST(LoopProposals, AlikeFurnitureInAnotherRoomIsNoLoop) {
  SecondPass pass(Drift(1, 0, {0.5, 0, 0}), 0);  // no point in common
  pass.Add(kRoom, false);
  pass.Add(kRoom, true);
  ASSERT_TRUE(LoopProposals().Find(pass.map, pass.current(), kMinApart));
  Rng rng(1);
  EXPECT_FALSE(LoopDetector().Detect(pass.map, pass.current(), rng));
}

}  // namespace
}  // namespace oaslam
