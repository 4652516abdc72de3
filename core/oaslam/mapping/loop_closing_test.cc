#include "oaslam/mapping/loop_closing.h"

#include <gtest/gtest.h>

#include <map>

#include "matchers.h"
#include "oaslam/mapping/local_mapping.h"
#include "synthetic_building.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr uint32_t kHalf = 18;
const synthetic::WorldOptions kLongWay{.cameras = 60, .arc_deg = 360};

// The keyframes of the way back, from kHalf on, get landmarks of their own: duplicates
// at the same positions.
void SplitByDirection(Map& map, uint32_t half = kHalf) {
  for (const LandmarkId id : map.landmarks.Ids()) {
    const std::vector<Observation> back = synthetic::TakeObservations(map, id, half);
    if (back.size() >= 2 && map.landmarks.Contains(id))
      synthetic::AddLandmark(map, map.landmarks.At(id).position, back);
  }
}

std::vector<Rigid3> ForthAndBack(std::vector<Rigid3> poses) {
  for (size_t k = poses.size(); k > 0; --k) poses.push_back(poses[k - 1]);
  return poses;
}

// The camera moves along the arc and back. On the way back the map has drifted and contains
// landmarks of its own.
struct Drifted {
  synthetic::World world;
  uint32_t half;
  Map map;
  std::vector<Rigid3> truth;

  explicit Drifted(double drift, const synthetic::WorldOptions& options = {.cameras = kHalf})
      : world(synthetic::MakeWorld(options)), half(static_cast<uint32_t>(options.cameras)) {
    world.cam_from_world = truth = ForthAndBack(world.cam_from_world);
    map = synthetic::MakeMap(world, {}).map;
    SplitByDirection(map, half);
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
    for (uint32_t k = 0; k < 2 * half; ++k) map.UpdateCovisibility(KeyframeId(k));
  }

  double Error() const { return CenterErrorsOf(synthetic::KeyframePoses(map), truth).rms; }

 private:
  double Share(KeyframeId id) const { return id.value < half ? 0 : 1; }
  static Eigen::Vector3d Moved(const Eigen::Vector3d& x, double share, double drift) {
    return x + share * drift * Eigen::Vector3d(1, 0.5, 0.3);
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
  CorrectLoop(*loop, d.map);
  EXPECT_LT(d.Error(), error_before);
  EXPECT_LT(d.map.landmarks.size(), landmarks_before * 9 / 10);
  EXPECT_THAT(d.map.CheckInvariants(), IsEmpty());
  EXPECT_LT(CenterDistance(d.map.keyframes.At(current).cam_from_world, d.truth.back()), 0.02);
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
  ASSERT_TRUE(CorrectLoop(*loop, d.map));
  const Anchor& anchor = d.map.anchors.at("it");
  EXPECT_LT((WorldFromAnchor(d.map, anchor)->translation - loop->old_from_current * before).norm(),
            1e-9);
  EXPECT_NEAR(anchor.size, 0.36, 1e-9);
  EXPECT_NEAR(anchor.offset.z(), 1.2, 1e-9);
}

// Splits each landmark into several, one for every six keyframes and direction, so that tracks are
// as short as those of a camera that moves on.
void CutIntoTracks(Map& map) {
  constexpr uint32_t kLength = 6;
  for (const LandmarkId id : map.landmarks.Ids()) {
    const Landmark whole = map.landmarks.At(id);
    map.EraseLandmark(id);
    std::map<std::pair<bool, uint32_t>, std::vector<Observation>> tracks;
    for (const Observation& o : whole.observations)
      tracks[{o.keyframe.value >= kHalf, (o.keyframe.value + id.value) / kLength}].push_back(o);
    for (const auto& [key, observations] : tracks)
      if (observations.size() >= 2) synthetic::AddLandmark(map, whole.position, observations);
  }
}

// The camera moves along the arc and back, while the scale drifts: the surroundings of each
// keyframe have a scale of their own, and each step of the camera has the scale of its place.
struct Grown {
  std::vector<Rigid3> truth;
  std::vector<double> true_depth;  // median, of each keyframe's landmarks
  std::vector<double> scales;      // of each keyframe
  Map map;

  explicit Grown(double last_scale) {
    synthetic::World world = synthetic::MakeWorld({.cameras = kHalf});
    world.cam_from_world = truth = ForthAndBack(world.cam_from_world);
    map = synthetic::MakeMap(world, {}).map;
    CutIntoTracks(map);
    std::vector<Eigen::Vector3d> centers;
    for (uint32_t k = 0; k < truth.size(); ++k) {
      true_depth.push_back(map.MedianDepth(KeyframeId(k)));
      scales.push_back(std::pow(last_scale, k / (2.0 * kHalf - 1)));
      const Eigen::Vector3d center = truth[k].OriginInSource();
      centers.push_back(k == 0 ? center
                               : centers.back() +
                                     scales.back() * (center - truth[k - 1].OriginInSource()));
    }
    for (const LandmarkId id : map.landmarks.Ids()) {
      Landmark& landmark = map.landmarks.MutableAt(id);
      const uint32_t k = landmark.observations.front().keyframe.value;
      landmark.position = centers[k] + scales[k] * (landmark.position - truth[k].OriginInSource());
    }
    for (uint32_t k = 0; k < truth.size(); ++k) {
      Rigid3& pose = map.keyframes.MutableAt(KeyframeId(k)).cam_from_world;
      pose.translation = -(pose.rotation * centers[k]);
    }
    for (uint32_t k = 0; k < truth.size(); ++k) map.UpdateCovisibility(KeyframeId(k));
  }

  double CenterError() const { return CenterErrorsOf(synthetic::KeyframePoses(map), truth).rms; }

  // The largest scale error of the surroundings of a keyframe: |ln of the ratio|.
  double WorstScale() const {
    double worst = 0;
    for (uint32_t k = 0; k < truth.size(); ++k)
      worst = std::max(worst, std::abs(std::log(map.MedianDepth(KeyframeId(k)) / true_depth[k])));
    return worst;
  }
};

TEST(LoopClosing, TakesBackADriftOfTheScale) {
  for (const double scale : {1.35, 0.75}) {
    Grown g(scale);
    ASSERT_THAT(g.map.CheckInvariants(), IsEmpty());
    const KeyframeId current(2 * kHalf - 1);
    const Rigid3& cam = g.map.keyframes.At(current).cam_from_world;
    const Ellipsoid as_it_is{g.truth.back().Inverse() * Eigen::Vector3d(0.2, -0.1, 2.5),
                             {0.1, 0.2, 0.3},
                             Eigen::Quaterniond::Identity()};
    Object object = synthetic::MappedObject({0, as_it_is});
    object.ellipsoid.center =
        cam.OriginInSource() + scale * (as_it_is.center - g.truth.back().OriginInSource());
    object.ellipsoid.half_axes *= scale;
    object.observations.emplace_back().reference = current;
    synthetic::AddObject(g.map, object);

    const KeyframeId before(current.value - 1);
    const auto motion_between = [&] {
      return g.map.keyframes.At(current).cam_from_world *
             g.map.keyframes.At(before).cam_from_world.Inverse();
    };
    g.map.keyframes.MutableAt(current).motion =
        KeyframeMotion{before, motion_between(), 0.01, 0.01};

    Rng rng(1);
    const auto loop = LoopDetector().Detect(g.map, current, rng);
    ASSERT_TRUE(loop) << scale;
    // A landmark has the scale of where it was first seen, some keyframes ago.
    EXPECT_NEAR(loop->old_from_current.scale * scale / g.scales[loop->old.value], 1, 0.06);
    const double error_before = g.CenterError();
    ASSERT_GT(g.WorstScale(), 0.25);
    ASSERT_TRUE(CorrectLoop(*loop, g.map));
    EXPECT_THAT(g.map.CheckInvariants(), IsEmpty());
    EXPECT_LT(g.WorstScale(), 0.13) << scale;
    EXPECT_LT(g.CenterError(), 0.5 * error_before) << scale;
    EXPECT_LT(CenterDistance(g.map.keyframes.At(current).cam_from_world, g.truth.back()), 0.03)
        << scale;
    // What the odometry measured is in the unit of the map, too.
    const KeyframeMotion& motion = *g.map.keyframes.At(current).motion;
    const double length = motion_between().translation.norm();
    EXPECT_NEAR(motion.cam_from_cam.translation.norm(), length, 0.1 * length) << scale;
    EXPECT_NEAR(motion.sigma_position * scale, 0.01, 0.001) << scale;
    const Ellipsoid& corrected = g.map.objects.At(ObjectId(0)).ellipsoid;
    EXPECT_LT((corrected.center - as_it_is.center).norm(), 0.2) << scale;
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(corrected.half_axes[i] / as_it_is.half_axes[i], 1, 0.06) << scale;
  }
}

// A camera goes once round. At a doorway, of which hardly anything is seen from both sides, it
// loses its scale, and what comes after has another one.
struct Parted {
  synthetic::World world = synthetic::MakeWorld({.points = 2400, .cameras = 48, .arc_deg = 345});
  Map map = synthetic::MakeMap(world, {}).map;
  double scale;
  KeyframeId door;

  Parted(double given_scale, uint32_t at) : scale(given_scale), door(at) {
    // What is seen on either side is another landmark there, but for a few seen through the door.
    for (const LandmarkId id : map.landmarks.Ids()) {
      const uint32_t end = door.value + (id.value % 100 == 0 ? 3 : 0);
      const Landmark whole = map.landmarks.At(id);
      if (whole.observations.front().keyframe.value >= end) continue;
      const std::vector<Observation> beyond = synthetic::TakeObservations(map, id, end);
      if (beyond.size() >= 2) synthetic::AddLandmark(map, whole.position, beyond);
    }
    for (const LandmarkId id : map.landmarks.Ids()) {
      Landmark& landmark = map.landmarks.MutableAt(id);
      if (!(landmark.observations.front().keyframe < door))
        landmark.position = Beyond() * landmark.position;
    }
    for (const KeyframeId id : map.keyframes.Ids()) {
      Keyframe& keyframe = map.keyframes.MutableAt(id);
      if (!(id < door))
        keyframe.cam_from_world =
            (Similarity(keyframe.cam_from_world) * Beyond().Inverse()).AsPose();
      map.UpdateCovisibility(id);
    }
  }

  // What is beyond the door grows about the last camera before it.
  Similarity Beyond() const {
    const Eigen::Vector3d center = world.cam_from_world[door.value - 1].OriginInSource();
    return {scale, Eigen::Quaterniond::Identity(), (1 - scale) * center};
  }

  LoopClosure Loop() const {
    return {map.keyframes.Ids().back(), KeyframeId(0), Beyond().Inverse(), {}};
  }

  // The worst error of a step between neighbours away from the door, as a share of it, the local
  // scale being free.
  double WorstShape() const {
    double worst = 0;
    for (uint32_t k = 1; k + 1 < world.cam_from_world.size(); ++k) {
      if (k >= door.value - 1 && k <= door.value + 1) continue;
      const auto step = [&](uint32_t from, const auto& pose_of) {
        return (pose_of(from + 1) * pose_of(from).Inverse()).translation.eval();
      };
      const auto own = [&](uint32_t i) { return map.keyframes.At(KeyframeId(i)).cam_from_world; };
      const auto truth = [&](uint32_t i) { return world.cam_from_world[i]; };
      const Eigen::Vector3d a = step(k - 1, own), b = step(k, own), c = step(k - 1, truth),
                            d = step(k, truth);
      worst = std::max(worst, std::abs(std::log(b.norm() / a.norm() * c.norm() / d.norm())));
      worst = std::max(worst, (b.normalized() - d.normalized()).norm());
    }
    return worst;
  }

  double WorstCenter() const {
    return CenterErrorsOf(synthetic::KeyframePoses(map), world.cam_from_world).worst;
  }

  // The odometry loses the scale from a keyframe on.
  void LoseScaleFrom(uint32_t first) {
    for (const KeyframeId id : map.keyframes.Ids()) {
      Keyframe& keyframe = map.keyframes.MutableAt(id);
      keyframe.timestamp = 0.1 * id.value;
      keyframe.scale_drift = ScaleDrift{0, id.value < first ? 0.0 : 0.04};
    }
  }
};

TEST(LoopClosing, AScaleLostAtADoorwayIsMendedThere) {
  for (const double scale : {0.1, 0.25, 0.5, 0.7, 0.9, 1.1, 1.4, 2.0, 4.0, 10.0})
    for (const uint32_t door : {12U, 33U}) {
      Parted p(scale, door);
      ASSERT_THAT(p.map.CheckInvariants(), IsEmpty());
      ASSERT_LT(p.WorstShape(), 1e-6);
      ASSERT_TRUE(CorrectLoop(p.Loop(), p.map));
      EXPECT_LT(p.WorstShape(), 0.02) << scale << ", door at " << door;
      EXPECT_LT(p.WorstCenter(), 0.1) << scale << ", door at " << door;
      // Images keep their place beside their keyframe.
      EXPECT_NEAR(p.map.keyframes.At(KeyframeId(door + 3)).unit * scale, 1, 0.05) << scale;
    }
}

// A loop that tells where the camera is, but not how long things are there: the scale is mended
// where the odometry lost it, so that both the end and the way there come nearer to the truth.
TEST(LoopClosing, AScaleThatTheLoopDoesNotTellIsThatOfTheWay) {
  for (const double scale : {0.8, 1.25}) {
    constexpr uint32_t kDoor = 12;
    Parted p(scale, kDoor);
    p.LoseScaleFrom(kDoor);
    LoopClosure loop = p.Loop();
    const Eigen::Vector3d center = p.map.keyframes.At(loop.current).cam_from_world.OriginInSource();
    loop.old_from_current =
        Similarity(1, Eigen::Quaterniond::Identity(), loop.old_from_current * center - center);
    loop.is_scale_known = false;
    const double before = p.WorstCenter();
    ASSERT_TRUE(CorrectLoop(loop, p.map));
    EXPECT_LT(p.WorstShape(), 0.05) << scale;
    EXPECT_LT(p.WorstCenter(), 0.5 * before) << scale;
    EXPECT_LT(std::abs(std::log(p.map.keyframes.At(KeyframeId(30)).unit * scale)),
              0.7 * std::abs(std::log(scale)));
  }
}

// Few landmarks are shared at one door, but the odometry held the scale there, and lost it
// elsewhere.
TEST(LoopClosing, TheOdometryTellsWhereTheScaleWasLost) {
  constexpr uint32_t kDoor = 12, kLost = 33;
  constexpr double kScale = 1.3;
  Parted p(kScale, kDoor);
  p.LoseScaleFrom(kLost);
  for (const KeyframeId id : p.map.keyframes.Ids())
    if (id.value > 0) p.map.keyframes.MutableAt(id).motion.emplace();
  ASSERT_TRUE(CorrectLoop(p.Loop(), p.map));
  EXPECT_GT(p.map.keyframes.At(KeyframeId(kDoor + 5)).unit, 0.9);  // by landmarks it would be 0.77
  EXPECT_NEAR(p.map.keyframes.At(KeyframeId(kLost + 5)).unit * kScale, 1, 0.05);
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
  Object object = synthetic::MappedObject(
      synthetic::Upright(0, true_center + kDrift * Eigen::Vector3d(1, 0.5, 0.3), {0.1, 0.1, 0.2}));
  object.observations.emplace_back().reference = current;
  synthetic::AddObject(d.map, object);

  Rng rng(1);
  const auto loop = LoopDetector().Detect(d.map, current, rng);
  ASSERT_TRUE(loop);
  EXPECT_NEAR(loop->old_from_current.scale, 1, 0.02);
  const double error_before = d.Error();
  CorrectLoop(*loop, d.map);
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

// In a large map the pose graph has fewer nodes than keyframes, and those between move along.
TEST(LoopClosing, TakesBackTheDriftOfALargeMap) {
  constexpr int kKeyframes = 1200;
  synthetic::Building building({.keyframes = kKeyframes, .objects = 0, .is_loop = true});
  Map map = building.map();
  std::vector<Rigid3> truth;
  for (int k = 0; k < kKeyframes; ++k) truth.push_back(building.PoseAt(k));
  const auto error = [&] { return CenterErrorsOf(synthetic::KeyframePoses(map), truth).worst; };
  const double before = error();
  LoopDetector detector;
  Rng rng(8);
  std::optional<LoopClosure> loop;
  for (uint32_t k = kKeyframes - 48; k < kKeyframes && !loop; ++k)
    loop = detector.Detect(map, KeyframeId(k), rng);
  ASSERT_TRUE(loop);
  ASSERT_TRUE(CorrectLoop(*loop, map));
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
  EXPECT_LT(error(), 0.5 * before);
  // Neighbours still agree on what they see: the correction has no steps between nodes.
  const std::vector<Rigid3> poses = synthetic::KeyframePoses(map);
  double worst_step = 0;
  for (size_t k = 1; k < kKeyframes; ++k)
    worst_step = std::max(worst_step, std::abs(CenterDistance(poses[k], poses[k - 1]) - 0.7));
  EXPECT_LT(worst_step, 0.07);
}

TEST(Culling, PacksAllButTheNewestKeyframes) {
  synthetic::Building building({.keyframes = 504, .objects = 0});
  Map map = building.map();
  std::vector<KeyframeId> unsettled = map.keyframes.Ids();
  // A keyframe of which all key points but those of one landmark are free.
  const auto free_all_but_one = [&](KeyframeId id) {
    const std::vector<LandmarkId> seen = map.keyframes.At(id).landmarks;
    for (size_t i = 1; i < seen.size(); ++i) map.EraseObservation(seen[i], id);
  };
  for (const uint32_t k : {1, 3, 4}) free_all_but_one(KeyframeId(k));
  map.RetireKeyframe(KeyframeId(0));
  unsettled = PackSettledKeyframes(unsettled, map);
  ASSERT_EQ(unsettled.size(), 500U);
  EXPECT_EQ(unsettled.front(), KeyframeId(4));
  EXPECT_LE(map.keyframes.At(KeyframeId(1)).features->size(), 1);
  EXPECT_LE(map.keyframes.At(KeyframeId(3)).features->size(), 1);
  EXPECT_GT(map.keyframes.At(KeyframeId(4)).features->size(), 100);
  EXPECT_EQ(PackSettledKeyframes(unsettled, map), unsettled);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

}  // namespace
}  // namespace oaslam
