#include "oaslam/objects/upright.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "oaslam/geometry/degree.h"
#include "object_table.h"

namespace oaslam {
namespace {

// The orientation of a camera, in degrees, in a world whose z axis is up: yaw to the left, pitch
// downwards, roll clockwise.
struct Held {
  double yaw = 0, pitch = 0, roll = 0;
};

Eigen::Matrix3d CamFromWorld(const Held& held) {
  Eigen::Matrix3d level;  // looks along y
  level << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const auto turn = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees * kDegree, axis).toRotationMatrix();
  };
  return turn(held.roll, Eigen::Vector3d::UnitZ()) * turn(held.pitch, Eigen::Vector3d::UnitX()) *
         level * turn(-held.yaw, Eigen::Vector3d::UnitZ());
}

// Three views a second, for `seconds`.
std::vector<Eigen::Matrix3d> Film(double seconds, const std::function<Held(double)>& held_at) {
  std::vector<Eigen::Matrix3d> cameras;
  for (int i = 0; i < 3 * seconds; ++i) cameras.push_back(CamFromWorld(held_at(i / 3.0)));
  return cameras;
}

double ErrorDeg(const Upright& upright) {
  return std::acos(std::clamp(upright.up.z(), -1.0, 1.0)) / kDegree;
}

// How much the hand shakes, degrees.
double Unrest(double t) { return 1.5 * std::sin(2.1 * t) + 1.5 * std::sin(3.7 * t + 1); }

TEST(Upright, ACameraThatRollsTellsNothing) {
  // The camera looks 17 degrees down and rolls by 15 to 20 degrees: its x axes vary in one plane
  // only, as if it turned about its optical axis.
  for (const double amplitude : {15.0, 17.0, 20.0})
    for (const double sway : {0.0, 3.0, 8.0})
      for (const double pitch : {0.0, 17.0, 30.0}) {
        const auto cameras = Film(20, [&](double t) {
          return Held{sway * std::sin(0.9 * t), pitch + Unrest(t), amplitude * std::sin(1.3 * t)};
        });
        for (size_t count = 5; count <= cameras.size(); ++count) {
          const auto upright = UprightOf(std::span(cameras).first(count));
          EXPECT_FALSE(upright) << amplitude << " " << sway << " " << pitch << " after " << count
                                << ": " << ErrorDeg(*upright);
        }
      }
}

TEST(Upright, IsToldByATurn) {
  for (const double pitch : {-10.0, 0.0, 17.0, 45.0}) {
    const auto cameras = Film(20, [&](double t) {
      return Held{6 * t, pitch + 3 * Unrest(t), Unrest(t + 9)};
    });
    const auto upright = UprightOf(cameras);
    ASSERT_TRUE(upright) << pitch;
    EXPECT_LT(ErrorDeg(*upright), 1.5) << pitch;
    EXPECT_LT(upright->sigma_rad, 6 * kDegree);
    EXPECT_FALSE(UprightOf(std::span(cameras).first(9))) << pitch;  // turned too little
  }
}

TEST(Upright, IsToldByATurnAlthoughTheCameraRolls) {
  const auto upright = UprightOf(Film(40, [](double t) {
    return Held{20 * t, 17 + Unrest(t), 12 * std::sin(1.3 * t)};
  }));
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
  EXPECT_FALSE(UprightOf(Film(20, [](double t) {
    return Held{Unrest(t), 17 + 35 * std::sin(t), Unrest(t + 9)};
  })));
}

TEST(Upright, OfAPhoneHeldSidewaysIsToldByHalfATurn) {
  for (const double roll : {90.0, -90.0}) {
    const auto cameras = Film(40, [&](double t) {
      return Held{8 * t, 20 + Unrest(t), roll + Unrest(t + 9)};
    });
    for (size_t count = 5; count <= cameras.size(); ++count) {
      const auto upright = UprightOf(std::span(cameras).first(count));
      EXPECT_LT(upright ? ErrorDeg(*upright) : 0, 4) << roll << " after " << count;
    }
    EXPECT_TRUE(UprightOf(cameras)) << roll;
  }
}

TEST(Upright, OfAPhoneHeldSidewaysThatDoesNotLookDownIsNotTold) {
  EXPECT_FALSE(UprightOf(Film(40, [](double t) {
    return Held{8 * t, Unrest(t), 90 + Unrest(t + 9)};
  })));
}

TEST(Upright, StraightDownOnlyAWideTurnTells) {
  const auto film = [](double yaw_rate) {
    return Film(20, [=](double t) { return Held{yaw_rate * t, 65 + Unrest(t), Unrest(t + 9)}; });
  };
  EXPECT_FALSE(UprightOf(film(3)));
  const auto upright = UprightOf(film(18));
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 3);
}

std::vector<GravityView> Measured(int views,
                                  const std::function<Eigen::Vector3d(int)>& disturbance) {
  std::vector<GravityView> measured;
  for (int i = 0; i < views; ++i) {
    const Eigen::Matrix3d cam_from_world =
        CamFromWorld({3.0 * i, 17 + 40 * std::sin(0.3 * i), 60 * std::sin(0.7 * i)});
    measured.push_back(
        {cam_from_world, cam_from_world * (Eigen::Vector3d(0, 0, -9.81) + disturbance(i))});
  }
  return measured;
}

TEST(Gravity, IsTheMeanOfTheViews) {
  const auto upright = UprightFromGravity(Measured(20, [](int i) {
    return Eigen::Vector3d(0.4 * std::sin(2.0 * i), 0.4 * std::cos(2.9 * i), 0);
  }));
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 0.5);
  EXPECT_LT(upright->sigma_rad, 1 * kDegree);
}

TEST(Gravity, ShakesAreOutvoted) {
  // A third of the views is shaken, always towards the same side.
  const auto upright = UprightFromGravity(Measured(
      30, [](int i) { return i % 3 == 0 ? Eigen::Vector3d(6, 0, 0) : Eigen::Vector3d(0, 0, 0); }));
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 1);
}

TEST(Gravity, AnyLengthWillDo) {
  auto views = Measured(10, [](int) { return Eigen::Vector3d(0, 0, 0); });
  for (size_t i = 0; i < views.size(); ++i) views[i].gravity_in_cam *= 1.0 + static_cast<double>(i);
  const auto upright = UprightFromGravity(views);
  ASSERT_TRUE(upright);
  EXPECT_LT(ErrorDeg(*upright), 0.1);
}

TEST(Gravity, NothingWhereSamplesContradictEachOther) {
  EXPECT_FALSE(UprightFromGravity(Measured(12, [](int i) {
    return Eigen::Vector3d(20 * std::cos(2.0 * i), 20 * std::sin(2.0 * i), 20 * std::sin(1.1 * i));
  })));
  EXPECT_FALSE(UprightFromGravity(Measured(2, [](int) { return Eigen::Vector3d(0, 0, 0); })));
}

Map MapOf(const std::vector<Eigen::Matrix3d>& cameras) {
  Map map;
  for (uint32_t i = 0; i < cameras.size(); ++i) {
    Keyframe keyframe;
    keyframe.cam_from_world.rotation = Eigen::Quaterniond(cameras[i]);
    map.keyframes.Insert(KeyframeId(i), keyframe);
  }
  return map;
}

TEST(Gravity, GoesBeforeTheGuess) {
  // The camera turns about an axis that is tilted by 30 degrees: the estimate is wrong, and nothing
  // in the views shows it.
  const Eigen::Matrix3d tilt =
      Eigen::AngleAxisd(30 * kDegree, Eigen::Vector3d::UnitX()).toRotationMatrix();
  std::vector<Eigen::Matrix3d> cameras = Film(20, [](double t) {
    return Held{6 * t, 10 + Unrest(t), Unrest(t + 9)};
  });
  for (Eigen::Matrix3d& camera : cameras) camera = camera * tilt;
  Map map = MapOf(cameras);
  UpdateUp(map);
  ASSERT_TRUE(map.up);
  EXPECT_GT(std::acos(map.up->z()), 25 * kDegree);
  EXPECT_EQ(map.up_keyframes, 0);
  for (const KeyframeId id : map.keyframes.Ids()) {
    if (id.value % 6 != 0) continue;
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    keyframe.gravity_in_cam = keyframe.cam_from_world.rotation * Eigen::Vector3d(0, 0, -9.81);
  }
  UpdateUp(map);
  EXPECT_GT(map.up->z(), std::cos(0.1 * kDegree));
  EXPECT_EQ(map.up_keyframes, 10);
}

TEST(Gravity, ThatALoadedMapKnowsStaysUntilAsMuchIsMeasuredAnew) {
  Map map = MapOf(Film(20, [](double t) { return Held{6 * t, 10 + Unrest(t), Unrest(t + 9)}; }));
  const Eigen::Vector3d stored = Eigen::Vector3d(0.3, 0, 1).normalized();
  map.up = stored;
  map.up_keyframes = 12;
  const auto measure = [&](uint32_t first, uint32_t last) {
    for (uint32_t i = first; i < last; ++i) {
      Keyframe& keyframe = map.keyframes.MutableAt(KeyframeId(i));
      keyframe.gravity_in_cam = keyframe.cam_from_world.rotation * Eigen::Vector3d(0, 0, -9.81);
    }
    UpdateUp(map);
  };
  measure(0, 5);
  EXPECT_EQ(*map.up, stored);
  measure(5, 12);
  EXPECT_GT(map.up->z(), std::cos(0.1 * kDegree));
}

TEST(Upright, FewViewsTellNothing) {
  EXPECT_FALSE(UprightOf({}));
  EXPECT_FALSE(UprightOf(Film(1, [](double t) { return Held{60 * t, 17, 0}; })));
}

TEST(Upright, IsTheAxisAboutWhichTheCamerasTurn) {
  Map map;
  const auto film = object_table::Film({}, 100, {}, 6);
  for (size_t i = 0; i < film.size(); ++i) {
    Keyframe keyframe;
    keyframe.cam_from_world = film[i].cam_from_world;
    map.keyframes.Insert(KeyframeId(static_cast<uint32_t>(i)), keyframe);
    if (i == 8) {
      UpdateUp(map);
      EXPECT_FALSE(map.up);  // the camera turned too little
    }
  }
  UpdateUp(map);
  ASSERT_TRUE(map.up);
  EXPECT_GT(map.up->dot(object_table::kUp), std::cos(0.03));
}

}  // namespace
}  // namespace oaslam
