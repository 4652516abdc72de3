#include "oaslam/bundle/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <stop_token>
#include <vector>

#include "matchers.h"
#include "oaslam/util/median.h"
#include "object_film.h"

namespace oaslam {
namespace {

struct Errors {
  double centers = 0, points = 0;  // RMS
};

Errors ErrorsOf(const Map& map, const synthetic::World& world,
                const std::vector<LandmarkId>& landmark_of_point) {
  double sum = 0;
  int points = 0;
  for (size_t i = 0; i < landmark_of_point.size(); ++i)
    if (const Landmark* landmark = map.landmarks.Find(landmark_of_point[i])) {
      sum += (landmark->position - world.points[i]).squaredNorm();
      ++points;
    }
  return {CenterErrorsOf(synthetic::KeyframePoses(map), world.cam_from_world).rms,
          std::sqrt(sum / points)};
}

// The median distance of key points from their projected landmarks.
double MedianErrorPx(const Map& map) {
  std::vector<double> errors;
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    for (const Observation& o : landmark.observations) {
      const Keyframe& by = map.keyframes.At(o.keyframe);
      const Eigen::Vector2d px =
          ProjectIdeal(map.cameras[by.camera], by.cam_from_world * landmark.position);
      errors.push_back((px - by.features->keypoints[o.keypoint].px.cast<double>()).norm());
    }
  });
  return Median(errors);
}

// The keyframes and landmarks of the world's map are disturbed.
struct DisturbedWorld {
  synthetic::World world;
  synthetic::MappedWorld mapped = synthetic::MakeMap(world, {.view = {.noise_px = 0.3},
                                                             .position_noise = 0.05,
                                                             .translation_noise = 0.03,
                                                             .rotation_noise_rad = 0.01});
  Map& map = mapped.map;

  // Adjusts all, and expects the world as it was: what remains is mostly an error of the scale,
  // which is not constrained.
  BundleCorrection Recover(int iterations) {
    const Errors before = ErrorsOf(map, world, mapped.landmark_of_point);
    const double before_px = MedianErrorPx(map);
    BundleCorrection correction = GlobalBundleAdjustment(map, iterations, BundleConfig{});
    EXPECT_TRUE(correction.success);
    EXPECT_EQ(correction.poses.size(), map.keyframes.size() - 1);  // the first is fixed
    ApplyCorrection(correction, map);
    EXPECT_THAT(map.CheckInvariants(), IsEmpty());
    EXPECT_LT(MedianErrorPx(map), 0.1 * before_px);
    const Errors after = ErrorsOf(map, world, mapped.landmark_of_point);
    EXPECT_LT(after.centers, 0.3 * before.centers);
    EXPECT_LT(after.points, 0.3 * before.points);
    return correction;
  }
};

TEST(BundleAdjustment, GlobalRecoversADisturbedWorld) {
  DisturbedWorld{synthetic::MakeWorld({.points = 300, .cameras = 6})}.Recover(20);
}

// More keyframes than the dense solver accepts, so that Ceres solves the problem, with points only.
TEST(BundleAdjustment, GlobalOfManyKeyframesRecoversADisturbedWorldAndFindsOutliers) {
  DisturbedWorld disturbed{synthetic::MakeWorld({.points = 250, .cameras = 70, .arc_deg = 120})};
  Map& map = disturbed.map;
  // The key point of one landmark in one view is wrong.
  const KeyframeId seen_wrongly(30);
  const std::vector<LandmarkId>& seen = map.keyframes.At(seen_wrongly).landmarks;
  const LandmarkId wrong = *std::ranges::find_if(seen, [](LandmarkId id) { return id.IsValid(); });
  const auto clutter = static_cast<uint32_t>(seen.size()) - 1;
  ASSERT_FALSE(seen[clutter].IsValid());
  map.EraseObservation(wrong, seen_wrongly);
  ASSERT_TRUE(map.AddObservation(wrong, seen_wrongly, clutter));
  const BundleCorrection correction = disturbed.Recover(40);
  EXPECT_EQ(correction.poses.at(0).first, KeyframeId(1));
  EXPECT_THAT(correction.outliers, testing::Contains(std::pair(wrong, seen_wrongly)));

  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(GlobalBundleAdjustment(map, 20, BundleConfig{}, stop.get_token()).success);
}

TEST(BundleAdjustment, LocalIsHeldByFixedObservers) {
  const synthetic::World world = synthetic::MakeWorld({.points = 400, .cameras = 10});
  auto [map, landmarks] = synthetic::MakeMap(world, {});
  Rng rng(3);
  for (const uint32_t k : {7U, 8U, 9U}) {
    Keyframe& keyframe = map.keyframes.MutableAt(KeyframeId(k));
    keyframe.cam_from_world = synthetic::Disturb(keyframe.cam_from_world, 0.05, 0.02, rng);
  }
  const BundleCorrection correction = LocalBundleAdjustment(map, KeyframeId(9), BundleConfig{}, 4);
  ASSERT_TRUE(correction.success);
  EXPECT_EQ(correction.poses.size(), 4U);
  ApplyCorrection(correction, map);
  for (const auto& [id, pose] : correction.poses)
    EXPECT_LT(CenterDistance(pose, world.cam_from_world[id.value]), 0.01) << id.value;
}

TEST(BundleAdjustment, OutliersAreFoundAndErased) {
  const synthetic::World world = synthetic::MakeWorld({.points = 300, .cameras = 6});
  auto [map, landmarks] = synthetic::MakeMap(world, {});
  // Some observations are wrong: their key point moves to one of clutter.
  std::vector<std::pair<LandmarkId, KeyframeId>> wrong;
  const KeyframeId keyframe_id(3);
  for (uint32_t i = 0,
                free = static_cast<uint32_t>(map.keyframes.At(keyframe_id).landmarks.size()) - 1;
       wrong.size() < 15; ++i) {
    const LandmarkId id = map.keyframes.At(keyframe_id).landmarks[i];
    if (!id.IsValid() || map.landmarks.At(id).observations.size() < 4) continue;
    map.EraseObservation(id, keyframe_id);
    ASSERT_TRUE(map.AddObservation(id, keyframe_id, free--));
    wrong.emplace_back(id, keyframe_id);
  }
  const BundleCorrection correction = LocalBundleAdjustment(map, KeyframeId(5), BundleConfig{});
  ASSERT_TRUE(correction.success);
  EXPECT_THAT(correction.outliers, testing::IsSupersetOf(wrong));
  size_t observations = 0;
  map.landmarks.ForEach(
      [&](LandmarkId, const Landmark& landmark) { observations += landmark.observations.size(); });
  EXPECT_LT(correction.outliers.size(), wrong.size() + observations / 10);
  ApplyCorrection(correction, map);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

TEST(BundleAdjustment, TheSameMapGivesTheSameBits) {
  const synthetic::World world = synthetic::MakeWorld({.points = 200, .cameras = 5});
  const Map map = synthetic::MakeMap(world, {.position_noise = 0.02}).map;
  const BundleCorrection a = LocalBundleAdjustment(map, KeyframeId(4), BundleConfig{});
  const std::vector<char> shift_the_heap(12345);
  const BundleCorrection b = LocalBundleAdjustment(Map(map), KeyframeId(4), BundleConfig{});
  ASSERT_TRUE(a.success && b.success);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (size_t i = 0; i < a.points.size(); ++i) EXPECT_EQ(a.points[i].second, b.points[i].second);
  for (size_t i = 0; i < a.poses.size(); ++i)
    EXPECT_EQ(a.poses[i].second.translation, b.poses[i].second.translation);
  EXPECT_EQ(a.outliers, b.outliers);
}

TEST(BundleAdjustment, ASingleKeyframeHasNothingToOptimise) {
  const synthetic::World world = synthetic::MakeWorld({.points = 50, .cameras = 1});
  const Map map = synthetic::MakeMap(world, {}).map;
  EXPECT_FALSE(GlobalBundleAdjustment(map, 10, BundleConfig{}).success);
  EXPECT_FALSE(LocalBundleAdjustment(map, KeyframeId(0), BundleConfig{}).success);
  EXPECT_FALSE(GlobalBundleAdjustment(Map(), 10, BundleConfig{}).success);
}

TEST(BundleAdjustment, ACorrectionSkipsWhatIsGone) {
  const synthetic::World world = synthetic::MakeWorld({.points = 200, .cameras = 5});
  Map map = synthetic::MakeMap(world, {.position_noise = 0.02}).map;
  const BundleCorrection correction = GlobalBundleAdjustment(map, 4, BundleConfig{});
  map.RetireKeyframe(KeyframeId(2));
  map.EraseLandmark(correction.points.front().first);
  ApplyCorrection(correction, map);
  EXPECT_THAT(map.CheckInvariants(), IsEmpty());
}

// Adds mapped objects in the middle of the world, each seen exactly by every camera.
void AddObjects(const synthetic::World& world, Map& map) {
  for (uint32_t i = 0; i < 6; ++i) {
    Object object = synthetic::MappedObject(
        synthetic::Upright(0, {-1.0 + 0.4 * i, 0.3 * (i % 3), 0.1 * (i % 2)}, {0.15, 0.15, 0.2}));
    for (uint32_t k = 0; k < world.cam_from_world.size(); ++k)
      object.observations.push_back(
          {static_cast<int>(10 * k),
           KeyframeId(k),
           {},
           0,
           *ProjectToBox(object.ellipsoid, world.cam_from_world[k], world.camera),
           1,
           0});
    synthetic::AddObject(map, std::move(object));
  }
}

double CenterError(const Map& map, const Map& truth) {
  double sum = 0;
  truth.objects.ForEach([&](ObjectId id, const Object& object) {
    sum += (map.objects.At(id).ellipsoid.center - object.ellipsoid.center).squaredNorm();
  });
  return std::sqrt(sum / static_cast<double>(truth.objects.size()));
}

// Scales everything but the objects about the first camera, which the points do not constrain.
void ScaleAroundFirst(double factor, Map& map) {
  const Eigen::Vector3d center = map.keyframes.At(KeyframeId(0)).cam_from_world.OriginInSource();
  const auto scaled = [&](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return center + factor * (x - center);
  };
  for (const KeyframeId id : map.keyframes.Ids()) {
    Rigid3& pose = map.keyframes.MutableAt(id).cam_from_world;
    pose.translation = -(pose.rotation * scaled(pose.OriginInSource()));
  }
  for (const LandmarkId id : map.landmarks.Ids())
    map.landmarks.MutableAt(id).position = scaled(map.landmarks.At(id).position);
}

TEST(BundleAdjustment, BoxesOfKnownEllipsoidsSetTheScale) {
  const synthetic::World world = synthetic::MakeWorld({.points = 40, .cameras = 6});
  auto [map, landmarks] = synthetic::MakeMap(world, {.view = {.noise_px = 0.3}});
  AddObjects(world, map);
  ScaleAroundFirst(1.1, map);
  const auto error_with = [&, &known = landmarks](BundleObjects how) {
    Map adjusted = map;
    const BundleCorrection correction =
        GlobalBundleAdjustment(map, 20, BundleConfig{.objects = how});
    EXPECT_TRUE(correction.success);
    EXPECT_EQ(correction.objects.size(), how == BundleObjects::kFull ? 6U : 0U);
    ApplyCorrection(correction, adjusted);
    return ErrorsOf(adjusted, world, known).centers;
  };
  const double before = ErrorsOf(map, world, landmarks).centers;
  EXPECT_GT(error_with(BundleObjects::kNone), 0.9 * before);
  EXPECT_LT(error_with(BundleObjects::kPoses), 0.1 * before);
  EXPECT_GT(error_with(BundleObjects::kFull), 0.5 * before);  // the ellipsoids follow instead
}

TEST(BundleAdjustment, FullItMovesEllipsoidsToTheirBoxes) {
  const synthetic::World world = synthetic::MakeWorld({.points = 300, .cameras = 6});
  Map truth = synthetic::MakeMap(world, {}).map;
  AddObjects(world, truth);
  Map map = truth;
  for (const ObjectId id : map.objects.Ids()) {
    Ellipsoid& e = map.objects.MutableAt(id).ellipsoid;
    e.center += Eigen::Vector3d(0.1, -0.08, 0.06);
    e.half_axes *= 1.4;
  }
  const double before = CenterError(map, truth);
  ApplyCorrection(
      LocalBundleAdjustment(map, KeyframeId(5), BundleConfig{.objects = BundleObjects::kFull}, 3),
      map);
  EXPECT_LT(CenterError(map, truth), 0.15 * before);
  EXPECT_NEAR(map.objects.At(ObjectId(0)).ellipsoid.half_axes.maxCoeff(), 0.2, 0.03);
}

TEST(BundleAdjustment, ALateCorrectionTakesNewcomersAlong) {
  const synthetic::World world = synthetic::MakeWorld({.points = 300, .cameras = 6});
  const Map truth = synthetic::MakeMap(world, {}).map;
  // All but the first keyframe and their landmarks are displaced, and the last keyframe did not
  // exist yet.
  Map now = truth;
  const Rigid3 displaced(Eigen::Quaterniond::Identity(), {0.1, 0, 0});
  for (uint32_t k = 1; k < 6; ++k) {
    Keyframe& keyframe = now.keyframes.MutableAt(KeyframeId(k));
    keyframe.cam_from_world = keyframe.cam_from_world * displaced.Inverse();
  }
  const LandmarkId newcomer =
      now.AddLandmark(Eigen::Vector3d(0.3, 0.2, 0.1) + displaced.translation, KeyframeId(4));
  for (const uint32_t k : {4U, 5U}) {
    const auto& taken = now.keyframes.At(KeyframeId(k)).landmarks;
    const auto free = std::ranges::find_if(taken, [](LandmarkId id) { return !id.IsValid(); });
    ASSERT_TRUE(
        now.AddObservation(newcomer, KeyframeId(k), static_cast<uint32_t>(free - taken.begin())));
  }
  Map corrected = truth;
  corrected.keyframes.Erase(KeyframeId(5));
  BundleCorrection correction;
  correction.success = true;
  for (uint32_t k = 1; k < 5; ++k)
    correction.poses.emplace_back(KeyframeId(k), truth.keyframes.At(KeyframeId(k)).cam_from_world);
  Object refitted;
  refitted.ellipsoid.center = {1, 2, 3};
  now.objects.Insert(ObjectId(0), refitted);
  correction.objects.emplace_back(ObjectId(0), Ellipsoid{});
  ApplyLateCorrection(correction, corrected, now);
  EXPECT_EQ(now.objects.At(ObjectId(0)).ellipsoid.center, refitted.ellipsoid.center);
  EXPECT_LT((now.keyframes.At(KeyframeId(5)).cam_from_world.translation -
             truth.keyframes.At(KeyframeId(5)).cam_from_world.translation)
                .norm(),
            1e-9);
  EXPECT_LT((now.landmarks.At(newcomer).position - Eigen::Vector3d(0.3, 0.2, 0.1)).norm(), 1e-9);
  EXPECT_THAT(now.CheckInvariants(), IsEmpty());
}

TEST(BundleAdjustment, AskedToStopItGivesUp) {
  const synthetic::World world = synthetic::MakeWorld({.points = 300, .cameras = 6});
  const Map map = synthetic::MakeMap(world, {.position_noise = 0.05}).map;
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(GlobalBundleAdjustment(map, 20, BundleConfig{}, stop.get_token()).success);
}

TEST(BundleAdjustment, WindowsOfALargeMapCoverItOnce) {
  Map map;
  for (uint32_t k = 0; k < 1300; ++k) map.keyframes.Insert(KeyframeId(2 * k), Keyframe());
  const std::vector<std::vector<KeyframeId>> windows = AdjustmentWindows(map);
  EXPECT_GT(windows.size(), 3U);
  std::vector<KeyframeId> all;
  for (const std::vector<KeyframeId>& window : windows) {
    EXPECT_LT(window.size(), 500U);
    EXPECT_TRUE(std::ranges::is_sorted(window));
    all.insert(all.end(), window.begin(), window.end());
  }
  EXPECT_EQ(windows.front().back(), KeyframeId(2598));  // the newest first
  std::ranges::sort(all);
  EXPECT_EQ(all, map.keyframes.Ids());
}

TEST(BundleAdjustment, AWindowHoldsWhatIsOutsideOfIt) {
  const synthetic::World world = synthetic::MakeWorld({.points = 300, .cameras = 10});
  auto [map, landmarks] = synthetic::MakeMap(world, {});
  Rng rng(4);
  const std::vector<KeyframeId> window = {KeyframeId(4), KeyframeId(5), KeyframeId(6)};
  for (const KeyframeId id : window) {
    Rigid3& pose = map.keyframes.MutableAt(id).cam_from_world;
    pose = synthetic::Disturb(pose, 0.03, 0.01, rng);
  }
  const Errors before = ErrorsOf(map, world, landmarks);
  const BundleCorrection correction = WindowBundleAdjustment(map, window, 20, BundleConfig{});
  ASSERT_TRUE(correction.success);
  ASSERT_EQ(correction.poses.size(), 3U);
  EXPECT_EQ(correction.poses.front().first, KeyframeId(4));
  ApplyCorrection(correction, map);
  EXPECT_LT(ErrorsOf(map, world, landmarks).centers, 0.2 * before.centers);
}

}  // namespace
}  // namespace oaslam
