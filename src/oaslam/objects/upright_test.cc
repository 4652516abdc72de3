#include "oaslam/objects/upright.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace oaslam {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

// How a camera is held: degrees, against a world whose z axis is up. Yaw to the left, pitch downwards, roll clockwise.
struct Held {
  double yaw = 0, pitch = 0, roll = 0;
};

Eigen::Matrix3d CamFromWorld(const Held& held) {
  Eigen::Matrix3d level;  // looks along y
  level << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const auto turn = [](double degrees, const Eigen::Vector3d& axis) { return Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix(); };
  return turn(held.roll, Eigen::Vector3d::UnitZ()) * turn(held.pitch, Eigen::Vector3d::UnitX()) * level *
         turn(-held.yaw, Eigen::Vector3d::UnitZ());
}

// Three views a second, for `seconds`.
std::vector<Eigen::Matrix3d> Film(double seconds, const std::function<Held(double)>& held_at) {
  std::vector<Eigen::Matrix3d> cameras;
  for (int i = 0; i < 3 * seconds; ++i) cameras.push_back(CamFromWorld(held_at(i / 3.0)));
  return cameras;
}

double ErrorDeg(const Upright& upright) { return std::acos(std::clamp(upright.up.z(), -1.0, 1.0)) / kDegree; }

// A hand's unrest, degrees.
double Unrest(double t) { return 1.5 * std::sin(2.1 * t) + 1.5 * std::sin(3.7 * t + 1); }

TEST(Upright, ACameraThatRollsTellsNothing) {
  // It looks 17 degrees down and rolls by 15 to 20: its x axes vary in one plane only, as if it turned about its optical axis.
  for (const double amplitude : {15.0, 17.0, 20.0})
    for (const double sway : {0.0, 3.0, 8.0})
      for (const double pitch : {0.0, 17.0, 30.0}) {
        const auto cameras = Film(20, [&](double t) {
          return Held{sway * std::sin(0.9 * t), pitch + Unrest(t), amplitude * std::sin(1.3 * t)};
        });
        for (size_t count = 5; count <= cameras.size(); ++count) {
          const auto upright = UprightOf(std::span(cameras).first(count));
          EXPECT_FALSE(upright) << amplitude << " " << sway << " " << pitch << " after " << count << ": " << ErrorDeg(*upright);
        }
      }
}

TEST(Upright, IsToldByATurn) {
  for (const double pitch : {-10.0, 0.0, 17.0, 45.0}) {
    const auto cameras = Film(20, [&](double t) { return Held{6 * t, pitch + 3 * Unrest(t), Unrest(t + 9)}; });
    const auto upright = UprightOf(cameras);
    ASSERT_TRUE(upright) << pitch;
    EXPECT_LT(ErrorDeg(*upright), 1.5) << pitch;
    EXPECT_LT(upright->sigma_rad, 6 * kDegree);
    EXPECT_FALSE(UprightOf(std::span(cameras).first(9))) << pitch;  // hardly turned
  }
}

TEST(Upright, IsToldByATurnAlthoughTheCameraRolls) {
  const auto upright = UprightOf(Film(40, [](double t) { return Held{20 * t, 17 + Unrest(t), 12 * std::sin(1.3 * t)}; }));
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 4);
}

TEST(Upright, SingleViewsHeldOtherwiseDoNotMatter) {
  const auto upright = UprightOf(Film(30, [](double t) {
    const bool is_turned = t > 12 && t < 15;
    return Held{6 * t, 17 + Unrest(t), is_turned ? 80.0 : Unrest(t + 9)};
  }));
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 1.5);
}

TEST(Upright, NoddingTellsNothing) {
  EXPECT_FALSE(UprightOf(Film(20, [](double t) { return Held{Unrest(t), 17 + 35 * std::sin(t), Unrest(t + 9)}; })));
}

TEST(Upright, OfAPhoneHeldSidewaysIsToldByHalfATurn) {
  for (const double roll : {90.0, -90.0}) {
    const auto cameras = Film(40, [&](double t) { return Held{8 * t, 20 + Unrest(t), roll + Unrest(t + 9)}; });
    for (size_t count = 5; count <= cameras.size(); ++count) {
      const auto upright = UprightOf(std::span(cameras).first(count));
      EXPECT_LT(upright ? ErrorDeg(*upright) : 0, 4) << roll << " after " << count;
    }
    EXPECT_TRUE(UprightOf(cameras)) << roll;
  }
}

TEST(Upright, OfAPhoneHeldSidewaysThatDoesNotLookDownIsNotTold) {
  EXPECT_FALSE(UprightOf(Film(40, [](double t) { return Held{8 * t, Unrest(t), 90 + Unrest(t + 9)}; })));
}

TEST(Upright, StraightDownOnlyAWideTurnTells) {
  const auto film = [](double yaw_rate) { return Film(20, [=](double t) { return Held{yaw_rate * t, 65 + Unrest(t), Unrest(t + 9)}; }); };
  EXPECT_FALSE(UprightOf(film(3)));
  const auto upright = UprightOf(film(18));
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 3);
}

TEST(Upright, FewViewsTellNothing) {
  EXPECT_FALSE(UprightOf({}));
  EXPECT_FALSE(UprightOf(Film(1, [](double t) { return Held{60 * t, 17, 0}; })));
}

}  // namespace
}  // namespace oaslam
