#include "oaslam/tracking/keyframe_units.h"

#include <gtest/gtest.h>

#include "oaslam/tracking/trajectory.h"

namespace oaslam {
namespace {

class KeyframeUnitsTest : public testing::Test {
 protected:
  KeyframeUnitsTest() {
    for (const uint32_t id : {1U, 2U, 3U}) map_.keyframes.Insert(KeyframeId(id), {});
    units_.ChangesIn(map_);
  }

  void Close(double unit) {
    map_.keyframes.MutableAt(KeyframeId(3)).unit *= unit;
    ++map_.loops_closed;
  }

  Map map_;
  KeyframeUnits units_;
};

TEST_F(KeyframeUnitsTest, TellWhatALoopHasChanged) {
  EXPECT_TRUE(units_.ChangesIn(map_).empty());
  Close(0.5);
  EXPECT_EQ(units_.ChangesIn(map_), (std::map<KeyframeId, double>{{KeyframeId(3), 0.5}}));
  EXPECT_TRUE(units_.ChangesIn(map_).empty());
  Close(3);
  EXPECT_EQ(units_.ChangesIn(map_), (std::map<KeyframeId, double>{{KeyframeId(3), 3.0}}));
}

TEST_F(KeyframeUnitsTest, AnotherMapIsTakenAsItIs) {
  Close(0.5);
  units_.BeginAnew();
  EXPECT_TRUE(units_.ChangesIn(map_).empty());
}

TEST_F(KeyframeUnitsTest, PosesKeepTheirPlaceBesideTheirKeyframe) {
  Trajectory trajectory;
  const Rigid3 beside(Rigid3::Rotation::Identity(), Eigen::Vector3d(1, 2, 0));
  trajectory.Add({7, 0.7, KeyframeId(2), beside}, {}, {});
  trajectory.Add({8, 0.8, KeyframeId(3), beside}, {}, {});
  Close(0.5);
  trajectory.Scale(units_.ChangesIn(map_));
  EXPECT_EQ(trajectory.PoseOf(7)->cam_from_reference.translation, Eigen::Vector3d(1, 2, 0));
  EXPECT_EQ(trajectory.PoseOf(8)->cam_from_reference.translation, Eigen::Vector3d(0.5, 1, 0));
}

}  // namespace
}  // namespace oaslam
