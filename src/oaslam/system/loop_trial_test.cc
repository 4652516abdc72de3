#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "oaslam/system/session.h"
#include "object_film.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

using synthetic::TrueObject;
using synthetic::Upright;
using testing::IsEmpty;

constexpr double kStorey = 3.6, kWay = 6;  // metres
constexpr double kStep = 0.03;             // metres between images
constexpr double kPoster = 1.3;            // half its side
constexpr int kAbout = 330;                // images about the place, at the end

// A wall of two storeys, and a camera that walks along the lower one, climbs, and walks back along
// the upper one. Things stand in front of the wall at both beginnings.
struct House {
  synthetic::World world;
  std::vector<TrueObject> lower, upper;

  // `has_posters`: a poster hangs on both storeys.
  explicit House(bool has_posters) {
    world = synthetic::MakeWorld({.points = 0, .cameras = 0});
    Rng rng(4);
    const auto add = [&](const Eigen::Vector3d& x) {
      world.points.push_back(x);
      world.descriptors.push_back(synthetic::RandomDescriptor(rng));
      world.max_distance.push_back(3 * std::pow(1.2, rng.Uniform(0, 4)));
      world.angles_rad.push_back(static_cast<float>(rng.Uniform(0, 6)));
    };
    const auto is_on_poster = [&](const Eigen::Vector3d& x, double height) {
      return has_posters && std::abs(x.x()) < kPoster && std::abs(x.z() - height) < kPoster;
    };
    for (int i = 0; i < 4500; ++i) {
      const Eigen::Vector3d x(rng.Uniform(-3.5, kWay + 2.5), rng.Uniform(-0.4, 0.4),
                              rng.Uniform(-1.5, kStorey + 1.5));
      if (!is_on_poster(x, kStorey)) add(x);
      if (!is_on_poster(x, 0)) continue;
      add(x + Eigen::Vector3d(0, 0, kStorey));
      world.descriptors.back() = world.descriptors[world.points.size() - 2];
      world.max_distance.back() = world.max_distance[world.points.size() - 2];
      world.angles_rad.back() = world.angles_rad[world.points.size() - 2];
    }
    for (int i = 0; i < 6; ++i) {
      const double z = i % 2 == 0 ? -0.7 : 0.6;
      lower.push_back(Upright(1 + i, {-1 + 0.4 * i, -0.7, z}, {0.13, 0.13, 0.15}));
      upper.push_back(Upright(11 + i, {-1.2 + 0.4 * i, -0.7, kStorey - z}, {0.13, 0.13, 0.15}));
    }
  }
};

// Where the camera goes, and from which of its images on things of the upper storey are detected.
struct Walk {
  std::vector<Eigen::Vector3d> centers;
  size_t detected_above = 0;

  void Go(const Eigen::Vector3d& to) {
    const Eigen::Vector3d from = centers.back();
    const int steps = static_cast<int>(std::ceil((to - from).norm() / kStep));
    for (int i = 1; i <= steps; ++i) centers.push_back(from + (to - from) * i / steps);
  }
  void StayAbout(const Eigen::Vector3d& place) {
    const Eigen::Vector3d aside(0.7, 0, 0), up(0, 0, 0.2), back(0, -0.4, 0);
    const size_t end = centers.size() + kAbout;
    while (centers.size() < end)
      for (const Eigen::Vector3d& to : std::vector<Eigen::Vector3d>{
               place - aside + up, place + back, place + aside - up, place})
        Go(to);
  }
};

struct Result {
  std::shared_ptr<const Map> map;
  int most_loops = 0;           // that were closed at a time
  double error = 0, scale = 0;  // of the trajectory, after the best similarity; of that
  int tracked = 0;
};

Result Film(const House& house, const Walk& walk, bool loop_closing) {
  SlamConfig config;
  config.runner.mode = RunnerMode::kSequential;
  config.mapping.loop_closing = loop_closing;
  // Many keyframes, as in the images of a real walk.
  config.tracking.max_keyframe_interval = 0.2;
  config.mapping.keyframe_redundancy = 1;
  Map empty;
  empty.cameras.push_back(house.world.camera);
  Session session(config, empty, {}, false);
  Rng rng(7);
  Result result;
  for (size_t i = 0; i < walk.centers.size(); ++i) {
    const Rigid3 pose =
        synthetic::LookAt(walk.centers[i], walk.centers[i] + Eigen::Vector3d::UnitY());
    Frame frame{static_cast<int>(i), static_cast<double>(i) / 30, 0, {}, {}};
    frame.features = synthetic::MakeView(house.world, pose, {.clutter = 20}, rng).features;
    frame.detections = synthetic::Detect(house.lower, pose, house.world.camera, {}, rng);
    if (i >= walk.detected_above)
      for (const ObjectDetection& d :
           synthetic::Detect(house.upper, pose, house.world.camera, {}, rng))
        frame.detections.push_back(d);
    session.Process(frame);
    result.most_loops = std::max(result.most_loops, session.snapshot()->loops_closed);
  }
  session.Finish();
  result.map = session.snapshot();
  const auto& poses = session.tracker().trajectory();
  result.tracked = static_cast<int>(poses.size());
  Eigen::Matrix3Xd estimated(3, poses.size()), truth(3, poses.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    estimated.col(static_cast<Eigen::Index>(i)) =
        (poses[i].cam_from_reference * *result.map->ResolvePose(poses[i].reference))
            .OriginInSource();
    truth.col(static_cast<Eigen::Index>(i)) =
        walk.centers[static_cast<size_t>(poses[i].frame_index)];
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(estimated, truth);
  const Eigen::Matrix3Xd moved =
      (fit.topLeftCorner<3, 3>() * estimated).colwise() + fit.topRightCorner<3, 1>();
  result.error = std::sqrt((moved - truth).colwise().squaredNorm().mean());
  result.scale = std::cbrt(fit.topLeftCorner<3, 3>().determinant());
  return result;
}

Walk WalkUp() {
  Walk walk{{{-1, -3, 0}}, 0};
  walk.Go({kWay, -3, 0});
  walk.Go({kWay, -3, kStorey});
  walk.Go({0, -3, kStorey});
  return walk;
}

// A poster on the upper storey looks like one on the lower. Things beside it are detected only
// after the loop has been closed, and then tell that this is another place.
TEST(LoopTrial, AWrongLoopIsUndoneOnceOtherThingsAreSeenThere) {
  const House house(true);
  Walk walk = WalkUp();
  walk.detected_above = walk.centers.size() + 20;
  walk.StayAbout({0, -3, kStorey});
  const Result without = Film(house, walk, false), undone = Film(house, walk, true);
  ASSERT_EQ(without.tracked, static_cast<int>(walk.centers.size()));
  ASSERT_EQ(without.most_loops, 0);
  EXPECT_GT(undone.most_loops, 0);
  EXPECT_EQ(undone.map->loops_closed, 0);
  EXPECT_FALSE(undone.map->undone_loops.empty());
  EXPECT_THAT(undone.map->CheckInvariants(), IsEmpty());
  EXPECT_GE(undone.tracked, without.tracked - 5);
  EXPECT_LT(undone.error, without.error + 0.02);
  EXPECT_NEAR(undone.scale / without.scale, 1, 0.02);
  EXPECT_LT(std::abs(static_cast<int>(undone.map->keyframes.size()) -
                     static_cast<int>(without.map->keyframes.size())),
            15);
}

TEST(LoopTrial, ATrueLoopIsNotUndone) {
  const House house(false);
  Walk walk = WalkUp();
  walk.Go({0, -3, 0});
  walk.StayAbout({0, -3, 0});
  const Result result = Film(house, walk, true);
  EXPECT_GE(result.map->loops_closed, 1);
  EXPECT_TRUE(result.map->undone_loops.empty());
  EXPECT_LT(result.error, 0.05);
}

}  // namespace
}  // namespace oaslam
