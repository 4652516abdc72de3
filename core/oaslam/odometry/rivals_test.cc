#include "oaslam/odometry/rivals.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "oaslam/estimation/two_view_models.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {
namespace {

constexpr double kFocalBesideWall = 500;
constexpr int kImagesBesideWall = 12, kLastRightImage = 7;

// A camera that walks along things in depth, of which the first images have seen enough, and comes
// before a wall that it sees at an angle.
class BesideAWall : public testing::Test {
 protected:
  BesideAWall() {
    for (int k = 0; k < kImagesBesideWall; ++k) {
      const Eigen::Quaterniond rotation = RotationOf({0.004 * k, -0.012 * k, 0.002 * k});
      truth_.emplace_back(Rigid3::Rotation(rotation),
                          rotation * -Eigen::Vector3d(0.06 * k, 0.01 * k, 0.02 * k));
    }
    for (int k = 0; k < kImagesBesideWall; ++k)
      window_.images.push_back({k, k / 10.0, truth_[k], true, k < 2});
    for (int i = 0; i < 60; ++i) {
      const Eigen::Vector2d ray(rng_.Uniform(-0.5, 0.5), rng_.Uniform(-0.4, 0.4));
      AddPoint(0, std::exp(rng_.Uniform(std::log(0.6), std::log(4))) * ray.homogeneous(), 0,
               kLastRightImage, true);
    }
    // A plane in the frame of the last image that is right, with some things before it.
    for (int i = 0; i < 150; ++i) {
      const Eigen::Vector2d ray(rng_.Uniform(-0.5, 0.5), rng_.Uniform(-0.4, 0.4));
      const double share = i % 15 == 0 ? rng_.Uniform(0.5, 0.9) : 1;  // of the wall's depth
      AddPoint(kLastRightImage, share / ray.homogeneous().dot(kNormal) * ray.homogeneous(),
               kLastRightImage, kImagesBesideWall - 1, false);
    }
  }

  void AddPoint(int anchor, const Eigen::Vector3d& in_anchor, int first, int last, bool is_known) {
    WindowPoint point{anchor, Eigen::Vector2f::Zero(), in_anchor.hnormalized()};
    if (is_known) {
      point.inverse_depth = point.prior_inverse_depth = 1 / in_anchor.z();
      point.variance = std::pow(0.02 * point.inverse_depth, 2);
    }
    const Eigen::Vector3d x = truth_[anchor].Inverse() * in_anchor;
    for (int k = std::max(first, anchor + 1); k <= last; ++k) {
      const Eigen::Vector2d noise(rng_.Gaussian(0.3), rng_.Gaussian(0.3));
      point.sightings.push_back(
          {k, Eigen::Vector2f::Zero(), (truth_[k] * x).hnormalized() + noise / kFocalBesideWall});
    }
    window_.points.push_back(point);
  }

  // The other motion that the wall allows takes the place of the right one.
  void TakeTheOtherMotion() {
    for (int k = kLastRightImage + 1; k < kImagesBesideWall; ++k) {
      const Rigid3 motion = truth_[k] * truth_[kLastRightImage].Inverse();
      const Eigen::Matrix3d homography =
          motion.rotation.toRotationMatrix() + motion.translation * kNormal.transpose();
      RayMatches matches;
      for (const WindowPoint& p : window_.points) {
        if (p.anchor != kLastRightImage) continue;
        matches.first.push_back(p.ray.homogeneous());
        matches.second.push_back((homography * p.ray.homogeneous()).hnormalized().homogeneous());
        matches.sigma.push_back(0.7);
      }
      matches.focal_first = matches.focal_second = kFocalBesideWall;
      Rigid3 other = motion;
      for (const Rigid3& m : MotionsOfHomography(homography, matches)) {
        // Its plane is that of the way, in front of the camera.
        if (m.rotation.angularDistance(motion.rotation) <
                other.rotation.angularDistance(motion.rotation) ||
            m.translation.dot(kNormal) > 0)
          continue;
        other = m;
      }
      other.translation *= motion.translation.norm();
      window_.images[k].cam_from_odom = other * truth_[kLastRightImage];
    }
  }

  // Depths and motion as the window finds them from here.
  void Settle() {
    WindowProblem made = ProblemOf(window_, kOptions, true);
    InverseDepthState state = made.StateOf(window_);
    SearchDepths(1.0, made.problem, state);
    InverseDepthSolver().Minimize(made.problem, {.max_iterations = 20, .tolerance = 1e-5}, state);
    made.Apply(state, window_);
  }

  // Degrees.
  double TurnOff(const Window& window) const {
    return window.newest().cam_from_odom.rotation.angularDistance(truth_.back().rotation) / kDegree;
  }

  std::optional<Rival> Look() {
    InverseDepthSolver solver;
    Rng rng(1);
    return BetterMotion(window_, 0.4, kOptions, solver, rng);
  }

  static constexpr WindowOptions kOptions{.focal_px = kFocalBesideWall};
  const Eigen::Vector3d kNormal{0.5, 0.2, 0.8};
  std::vector<Rigid3> truth_;
  Window window_;
  Rng rng_{3};
};

TEST_F(BesideAWall, TheRightMotionHasNoRival) {
  Settle();
  ASSERT_LT(TurnOff(window_), 0.5);
  EXPECT_FALSE(Look());
}

TEST_F(BesideAWall, TheRightMotionTakesThePlaceOfTheOther) {
  TakeTheOtherMotion();
  Settle();
  ASSERT_GT(TurnOff(window_), 2) << "the window has left the wrong minimum by itself";
  const std::optional<Rival> rival = Look();
  ASSERT_TRUE(rival);
  EXPECT_EQ(rival->since, kLastRightImage);
  EXPECT_LT(TurnOff(rival->window), 0.7);
  const Eigen::Vector3d way = rival->window.newest().cam_from_odom.OriginInSource() -
                              truth_[kLastRightImage].OriginInSource(),
                        true_way = truth_.back().OriginInSource() -
                                   truth_[kLastRightImage].OriginInSource();
  EXPECT_LT(std::acos(std::min(1.0, way.normalized().dot(true_way.normalized()))) / kDegree, 6);
}

TEST(RivalWatch, LooksWhereTheImagesFitWorseThanUsual) {
  RivalWatch watch;
  double time_s = 10;
  const auto look = [&](double cost) { return watch.SpanToLookAt(time_s += 0.05, cost); };
  look(1);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(look(0.9)) << i;
  const auto first = look(2), again = look(2);
  ASSERT_TRUE(first);
  EXPECT_FALSE(again) << "it has just looked";
  look(2);
  const auto later = look(2);
  ASSERT_TRUE(later);
  EXPECT_NE(*first, *later) << "short and long spans in turn";
}

// A film whose images fit worse now is looked through until that is usual.
TEST(RivalWatch, GetsUsedToAFilm) {
  RivalWatch watch;
  int early = 0, late = 0;  // looks in the first and the last second after the change
  for (int i = 0; i < 600; ++i) {
    const double cost = i < 30 ? 1 : 2 + 0.01 * (i % 2);
    const bool looks = watch.SpanToLookAt(i / 30.0, cost).has_value();
    if (i >= 30 && i < 60) early += looks;
    if (i >= 570) late += looks;
  }
  EXPECT_GT(early, 4);
  EXPECT_LT(late, early);
}

}  // namespace
}  // namespace oaslam
