#include "oaslam/odometry/window.h"

#include <gtest/gtest.h>

#include <cmath>

#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/odometry/beginning.h"
#include "oaslam/odometry/pose_starts.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

constexpr double kFocal = 500;

// A camera that moves to the right and turns a little, in front of a plane that it sees at an
// angle, or of points in depth; all points are seen from the first image on.
struct Walk {
  std::vector<Rigid3> truth;
  std::vector<Eigen::Vector3d> points;
  Rng rng{6};

  explicit Walk(bool is_plane, int images = 8) {
    for (int k = 0; k < images; ++k) {
      const Eigen::Quaterniond rotation = RotationOf({0.004 * k, -0.01 * k, 0.002 * k});
      truth.emplace_back(Rigid3::Rotation(rotation),
                         rotation * -Eigen::Vector3d(0.05 * k, 0.01 * k, 0.03 * k));
    }
    for (int i = 0; i < 120; ++i) {
      const Eigen::Vector2d ray(rng.Uniform(-0.5, 0.5), rng.Uniform(-0.4, 0.4));
      const double depth = is_plane ? 1.2 / (1 + 0.5 * ray.x() + 0.2 * ray.y())
                                    : std::exp(rng.Uniform(std::log(0.6), std::log(5)));
      points.push_back(depth * ray.homogeneous());
    }
  }

  // All poses are free but the first one; `poses`: what the window believes.
  Window Seen(const std::vector<Rigid3>& poses, bool knows_depths) {
    Window window;
    for (size_t k = 0; k < truth.size(); ++k)
      window.images.push_back(
          {static_cast<int>(k), static_cast<double>(k) / 10, poses[k], true, k == 0});
    for (const Eigen::Vector3d& x : points) {
      WindowPoint point{0, Eigen::Vector2f::Zero(), x.hnormalized()};
      if (knows_depths) point.inverse_depth = point.prior_inverse_depth = 1 / x.z();
      for (size_t k = 1; k < truth.size(); ++k) {
        const Eigen::Vector2d noise(rng.Gaussian(0.3), rng.Gaussian(0.3));
        point.sightings.push_back({static_cast<int>(k), Eigen::Vector2f::Zero(),
                                   (truth[k] * x).hnormalized() + noise / kFocal});
      }
      window.points.push_back(point);
    }
    return window;
  }

  // As before the motion is known: rotations of the flow, no translation.
  Window Beginning() {
    std::vector<Rigid3> turned;
    for (const Rigid3& pose : truth) turned.emplace_back(pose.rotation, Eigen::Vector3d::Zero());
    return Seen(turned, false);
  }

  // Degrees between the true and the estimated way from the first to the last image.
  double DirectionError(const Window& window) const {
    const Eigen::Vector3d way = window.newest().cam_from_odom.OriginInSource() -
                                window.images.front().cam_from_odom.OriginInSource();
    const double cosine = way.normalized().dot(truth.back().OriginInSource().normalized());
    return std::acos(std::min(1.0, cosine)) * 57.3;
  }
};

const WindowOptions kOptions{.focal_px = kFocal};

TEST(Window, APointStaysWhereItIsWhenItsAnchorGoes) {
  Walk walk(false);
  Window window = walk.Seen(walk.truth, true);
  const double before = window.InverseDepthIn(window.points[5], window.Image(4));
  window.Remove(0);
  EXPECT_FALSE(window.Has(0));
  const WindowPoint& point = window.points[5];
  EXPECT_EQ(point.anchor, 1);
  EXPECT_EQ(point.sightings.size(), walk.truth.size() - 2);
  EXPECT_NEAR(window.InverseDepthIn(point, window.Image(4)), before, 0.01);
  window.points[3].sightings.clear();
  window.Remove(1);
  EXPECT_EQ(window.points.size(), walk.points.size() - 1);  // one was seen in no other image
}

TEST(Window, AnEdgeIsAsTheNewAnchorSeesIt) {
  Walk walk(false);
  Window window = walk.Seen(walk.truth, true);
  Rigid3& next = window.Image(1).cam_from_odom;
  next = Rigid3(RotationOf({0, 0, 90 * kDegree}), Eigen::Vector3d::Zero()) * next;
  window.points[7].edge = {Eigen::Vector2d::UnitY(), 4};
  window.Remove(0);
  EXPECT_NEAR(std::abs(window.points[7].edge.along.x()), 1, 0.02);
  EXPECT_EQ(window.points[7].edge.slide, 4);
}

TEST(Window, TurnsAreJoinedWhereAnImageGoes) {
  Walk walk(false);
  Window window = walk.Seen(walk.truth, true);
  for (size_t k = 1; k < walk.truth.size(); ++k)
    window.images[k].turn = Turn{(walk.truth[k] * walk.truth[k - 1].Inverse()).rotation, 1e-6};
  window.Remove(3);
  window.Remove(4);
  const Rigid3 joined = walk.truth[5] * walk.truth[2].Inverse();
  ASSERT_TRUE(window.Image(5).turn);
  EXPECT_LT(window.Image(5).turn->second_from_first.angularDistance(joined.rotation), 1e-9);
  EXPECT_NEAR(window.Image(5).turn->variance, 3e-6, 1e-12);
  EXPECT_EQ(ProblemOf(window, kOptions, false).problem.rotations.size(), window.images.size() - 1);
  window.Image(6).turn.reset();
  window.Remove(6);
  EXPECT_FALSE(window.Image(7).turn);
}

TEST(Window, OutliersAreFlaggedAndNoLongerTracked) {
  Walk walk(false);
  Window window = walk.Seen(walk.truth, true);
  window.points[7].sightings.back().ray.x() += 5 / kFocal;
  window.points[9].sightings.front().ray.x() += 5 / kFocal;
  EXPECT_EQ(FlagOutliers(kOptions, window).inliers, static_cast<int>(walk.points.size()) - 1);
  EXPECT_FALSE(window.points[7].is_tracked);
  EXPECT_TRUE(window.points[9].is_tracked);  // only an old sighting is wrong
  EXPECT_TRUE(window.points[9].sightings.front().is_outlier);
  EXPECT_FALSE(window.points[9].sightings.back().is_outlier);
}

// Where points whose depth is well known do not fit, the newest poses may be what is wrong.
TEST(Window, APointOfGoodDepthStaysLongerThanOthers) {
  Walk walk(false);
  Window window = walk.Seen(walk.truth, true);
  for (WindowPoint& p : window.points) p.variance = p.inverse_depth * p.inverse_depth;
  WindowPoint &known = window.points[3], &fresh = window.points[4], &lost = window.points[5];
  known.variance = lost.variance = 1e-6;
  for (WindowPoint* p : {&known, &fresh, &lost})
    p->sightings.back().ray.x() += (p == &lost ? 20 : 6) / kFocal;
  const WindowFit fit = FlagOutliers(kOptions, window);
  EXPECT_TRUE(known.is_tracked);
  EXPECT_FALSE(fresh.is_tracked);
  EXPECT_FALSE(lost.is_tracked);
  EXPECT_EQ(fit.inliers, static_cast<int>(window.points.size()) - 3);
  // One that did not fit before either tells nothing new of the newest image.
  EXPECT_EQ(fit.compared, static_cast<int>(window.points.size()));
  known.sightings[known.sightings.size() - 2].ray.x() += 6 / kFocal;
  EXPECT_EQ(FlagOutliers(kOptions, window).compared, fit.compared - 1);
}

TEST(Window, UnusedPartsGo) {
  Walk walk(false);
  Window window = walk.Seen(walk.truth, true);
  for (size_t i = 0; i + 1 < window.images.size(); ++i) window.images[i].is_held = true;
  for (WindowPoint& p : window.points) {
    p.is_tracked = false;
    p.sightings.pop_back();  // only held images are left
  }
  window.RemoveUnused(window.newest().id);
  EXPECT_TRUE(window.points.empty());
  EXPECT_EQ(window.images.size(), 4);  // the newest keyframes
}

TEST(Beginning, TheMotionInFrontOfPointsInDepthIsFound) {
  Walk walk(false);
  Rng rng(1);
  const Beginning beginning = BeginMotion(walk.Beginning(), nullptr, kOptions, {}, 640, rng);
  ASSERT_TRUE(beginning.is_known);
  EXPECT_TRUE(beginning.is_decided);
  EXPECT_LT(walk.DirectionError(beginning.window), 3);
  std::vector<double> depths;
  for (const WindowPoint& p : beginning.window.points) depths.push_back(p.inverse_depth);
  std::ranges::nth_element(depths, depths.begin() + 60);
  EXPECT_NEAR(depths[60], 1, 0.1);
}

// The leader of the first images, by the rotation and the direction that it had there, leads on.
TEST(Beginning, TheLeaderIsFollowed) {
  Walk walk(false);
  Rng rng(1);
  Window earlier = walk.Beginning();
  earlier.Remove(earlier.newest().id);
  const Beginning then = BeginMotion(earlier, nullptr, kOptions, {}, 640, rng);
  ASSERT_TRUE(then.is_known);
  const Beginning now = FollowLeader(walk.Beginning(), then.window, kOptions);
  ASSERT_TRUE(now.is_known);
  EXPECT_FALSE(now.is_decided);
  EXPECT_LT(walk.DirectionError(now.window), 3);
}

// The rotation of the flow takes most of the way for a turn, so that depths are guessed too far.
TEST(Beginning, AWayThatLooksLikeATurnIsFound) {
  Walk walk(false, 12);
  for (size_t k = 0; k < walk.truth.size(); ++k)
    walk.truth[k].translation =
        walk.truth[k].rotation * -Eigen::Vector3d(0.05 * static_cast<double>(k), 0, 0);
  for (Eigen::Vector3d& x : walk.points) x *= walk.rng.Uniform(1, 1.1) / x.z();
  std::vector<Rigid3> turned{{walk.truth[0].rotation, Eigen::Vector3d::Zero()}};
  for (size_t k = 1; k < walk.truth.size(); ++k) {
    std::vector<Eigen::Vector2d> before, now;
    for (const Eigen::Vector3d& x : walk.points) {
      before.push_back((walk.truth[k - 1] * x).hnormalized());
      now.push_back((walk.truth[k] * x).hnormalized());
    }
    const Eigen::Matrix3d last = turned.back().rotation.toRotationMatrix();
    turned.emplace_back(RotationBetween(before, now, Eigen::Matrix3d::Identity()) * last,
                        Eigen::Vector3d::Zero());
  }
  Rng rng(1);
  const Beginning beginning =
      BeginMotion(walk.Seen(turned, false), nullptr, kOptions, {}, 640, rng);
  ASSERT_TRUE(beginning.is_known);
  EXPECT_LT(walk.DirectionError(beginning.window), 0.3);
}

// But for a tenth of what leads to the median depth.
TEST(Beginning, ItsUnitStays) {
  Walk walk(false);
  Rng rng(1);
  Window before = BeginMotion(walk.Beginning(), nullptr, kOptions, {}, 640, rng).window;
  for (WindowPoint& p : before.points) {
    p.inverse_depth *= 3;
    p.variance *= 9;
  }
  for (size_t i = 0; i < before.points.size(); ++i)
    before.points[i].anchor_px.x() = static_cast<float>(i);
  Window seen = walk.Beginning();
  for (size_t i = 0; i < seen.points.size(); ++i)
    seen.points[i].anchor_px.x() = static_cast<float>(i);
  const Beginning now = BeginMotion(seen, &before, kOptions, {}, 640, rng);
  EXPECT_NEAR(now.window.median_inverse_depth, std::pow(3, 0.9), 0.1);
  EXPECT_NEAR(now.window.points[5].inverse_depth / before.points[5].inverse_depth,
              std::pow(3, -0.1), 0.05);
}

// Two images allow two motions in front of a plane; all images together only one.
TEST(Beginning, TheMotionInFrontOfAPlaneIsFound) {
  Walk walk(true, 12);
  Rng rng(1);
  const Beginning beginning = BeginMotion(walk.Beginning(), nullptr, kOptions, {}, 640, rng);
  ASSERT_TRUE(beginning.is_known);
  EXPECT_LT(walk.DirectionError(beginning.window), 6);
}

TEST(Beginning, ACameraThatOnlyTurnsHasNoMotionYet) {
  Walk walk(false);
  for (Rigid3& pose : walk.truth) pose.translation.setZero();
  Rng rng(1);
  EXPECT_FALSE(BeginMotion(walk.Beginning(), nullptr, kOptions, {}, 640, rng).is_known);
}

}  // namespace
}  // namespace oaslam
