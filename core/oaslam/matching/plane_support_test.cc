#include "oaslam/matching/plane_support.h"

#include <gtest/gtest.h>

#include <vector>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

using Points = std::vector<Eigen::Vector3d>;

// On a wall 3 m away, up to 5 mm off.
Points OnAWall(int count, Rng& rng) {
  Points points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(rng.Uniform(-1, 1), rng.Uniform(-1, 1), 3 + rng.Uniform(-0.005, 0.005));
  return points;
}

// Things between the wall and the camera.
Points BeforeIt(int count, Rng& rng) {
  Points points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(rng.Uniform(-1, 1), rng.Uniform(-1, 1), rng.Uniform(1.5, 2.7));
  return points;
}

Points Joined(Points a, const Points& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(PlaneSupport, OfAPosterOnAnotherWallIsOfOnePlane) {
  Rng rng(1);
  const Points poster = OnAWall(60, rng),
               expected = Joined(Joined(poster, OnAWall(140, rng)), BeforeIt(100, rng));
  const PlaneSupport support = BesideThePlane(poster, expected, 3);
  EXPECT_EQ(support.beside, 0);
  EXPECT_NEAR(support.expected_beside, 30, 1);
  EXPECT_TRUE(support.IsOfOnePlane());
}

TEST(PlaneSupport, OfARoomThatIsSeenInPartsIsNot) {
  Rng rng(2);
  const Points wall = OnAWall(60, rng), things = BeforeIt(6, rng),
               expected = Joined(Joined(wall, OnAWall(140, rng)), BeforeIt(100, rng));
  const PlaneSupport support = BesideThePlane(Joined(wall, things), expected, 3);
  EXPECT_EQ(support.beside, 6);
  EXPECT_FALSE(support.IsOfOnePlane());
}

TEST(PlaneSupport, OfABareWallIsNot) {
  Rng rng(3);
  const Points wall = OnAWall(60, rng), expected = Joined(wall, BeforeIt(5, rng));
  EXPECT_FALSE(BesideThePlane(wall, expected, 3).IsOfOnePlane());
}

TEST(PlaneSupport, ThreePointsAreNoPlane) {
  Rng rng(4);
  const Points three = OnAWall(3, rng);
  EXPECT_FALSE(BesideThePlane(three, Joined(three, BeforeIt(500, rng)), 3).IsOfOnePlane());
  EXPECT_FALSE(BesideThePlane({}, BeforeIt(500, rng), 3).IsOfOnePlane());
}

TEST(PlaneSupport, OfAWindowAloneIsFlat) {
  Rng rng(5);
  const Points window = OnAWall(60, rng);
  EXPECT_TRUE(IsFlat(window, 3));
  EXPECT_TRUE(IsFlat(Joined(window, BeforeIt(5, rng)), 3));  // wrong matches
  EXPECT_FALSE(IsFlat(Joined(window, BeforeIt(10, rng)), 3));
  EXPECT_FALSE(IsFlat({}, 3));
}

TEST(PlaneSupport, AMapOfOneWallHasNoOther) {
  Rng rng(6);
  const Points wall = OnAWall(400, rng);
  EXPECT_TRUE(IsOneWall(Joined(wall, BeforeIt(100, rng)), 3));
  EXPECT_FALSE(IsOneWall(Joined(wall, BeforeIt(800, rng)), 3));
  EXPECT_FALSE(IsOneWall({}, 3));
}

}  // namespace
}  // namespace oaslam
