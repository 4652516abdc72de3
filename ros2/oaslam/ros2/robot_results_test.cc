#include "oaslam/ros2/robot_results.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <map>

#include "random_map.h"

namespace oaslam {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr int64_t kTick = 100'000'000, kFirst = 1'700'000'000'000'000'000;

struct RobotResultsTest : testing::Test {
  std::map<RobotTopic, std::vector<ByteBuffer>> written;
  RobotFrames frames;
  TransformBuffer transforms;
  ImageClock clock;
  std::shared_ptr<Map> map = [] {
    Rng rng(7);
    return std::make_shared<Map>(RandomMap({}, rng).map);
  }();

  RobotResults NewResults() {
    return {frames, [this](RobotTopic topic, const CdrWriter& message) {
              written[topic].emplace_back(message.bytes().begin(), message.bytes().end());
            }};
  }
  void AddOdom(int tick) {
    transforms.Add({"odom",
                    "base_link",
                    {Rigid3::Rotation::Identity(), {0.1 * tick, 0, 0}},
                    kFirst + tick * kTick},
                   false);
  }
  void AddMount() { transforms.Add({"base_link", "camera", Rigid3(), 0}, true); }
  void Add(RobotResults& results, int tick, bool is_lost = false) {
    const int64_t stamp = kFirst + tick * kTick;
    clock.Add(stamp);
    RobotResult result{.is_lost = is_lost, .world = WorldId(1), .map = map};
    if (!is_lost) result.world_from_cam = Rigid3(Rigid3::Rotation::Identity(), {0, 0, 0.1 * tick});
    results.Add(result, {stamp, "camera"}, clock, transforms, {});
  }
  // Ticks, parents and children.
  std::vector<std::string> Transforms() const {
    const auto all = written.find(RobotTopic::kTransforms);
    std::vector<std::string> found;
    if (all == written.end()) return found;
    for (const ByteBuffer& bytes : all->second) {
      const RecordedTopic topic{"/tf", "tf2_msgs/TFMessage", MessageEncoding::kCdr, ""};
      for (const RosTransform& t : ReadRosTransforms({&topic, 0, bytes}))
        found.push_back(fmt::format("{} {} {}", (t.stamp - kFirst) / kTick, t.parent, t.child));
    }
    return found;
  }
  size_t Count(RobotTopic topic) const {
    return written.contains(topic) ? written.at(topic).size() : 0;
  }
};

TEST_F(RobotResultsTest, OdomNeedsMetres) {
  AddMount();
  for (int tick = 0; tick < 9; ++tick) AddOdom(tick);
  RobotResults results = NewResults();
  map->is_metric = false;
  Add(results, 1);
  EXPECT_THAT(Transforms(), IsEmpty());
  map->is_metric = true;
  Add(results, 2);
  EXPECT_THAT(Transforms(), ElementsAre("2 map odom"));
  EXPECT_EQ(Count(RobotTopic::kPose), 2U);
  EXPECT_EQ(Count(RobotTopic::kOdometry), 0U) << "the first pose is that of the camera";
  Add(results, 3);
  EXPECT_EQ(Count(RobotTopic::kOdometry), 1U);
}

TEST_F(RobotResultsTest, InAnotherUnitThePoseIsThatOfTheCamera) {
  transforms.Add({"base_link", "camera", {Rigid3::Rotation::Identity(), {5, 0, 0}}, 0}, true);
  RobotResults results = NewResults();
  for (const bool is_metric : {false, true}) {
    map->is_metric = is_metric;
    Add(results, is_metric ? 2 : 1);
  }
  const std::vector<ByteBuffer>& poses = written[RobotTopic::kPose];
  ASSERT_EQ(poses.size(), 2U);
  const auto x_of = [](const ByteBuffer& bytes) {  // behind stamp and "map"
    double x = 0;
    std::memcpy(&x, bytes.data() + 4 + 16, sizeof x);
    return x;
  };
  EXPECT_GT(std::abs(x_of(poses[0]) - x_of(poses[1])), 4);
}

TEST_F(RobotResultsTest, OdomNeedsTheWholeRobot) {
  map->is_metric = true;
  for (int tick = 0; tick < 9; ++tick) AddOdom(tick);
  RobotResults results = NewResults();
  Add(results, 1);
  EXPECT_THAT(Transforms(), IsEmpty()) << "nobody tells where the camera is";
  EXPECT_EQ(Count(RobotTopic::kPose), 1U);
  AddMount();
  Add(results, 2);
  EXPECT_THAT(Transforms(), ElementsAre("2 map odom"));
  EXPECT_EQ(Count(RobotTopic::kOdometry), 0U) << "the poses are of two frames";
}

TEST_F(RobotResultsTest, WaitForTheTimeOfTheImage) {
  map->is_metric = true;
  AddMount();
  AddOdom(0);
  RobotResults results = NewResults();
  Add(results, 1);
  Add(results, 2);
  EXPECT_EQ(Count(RobotTopic::kPose), 2U);
  EXPECT_THAT(Transforms(), IsEmpty());
  AddOdom(1);
  results.Place(transforms);
  EXPECT_THAT(Transforms(), ElementsAre("1 map odom"));
  AddOdom(3);
  results.Place(transforms);
  EXPECT_THAT(Transforms(), ElementsAre("1 map odom", "2 map odom"));
}

TEST_F(RobotResultsTest, OdomStaysWhileTheCameraIsLost) {
  map->is_metric = true;
  AddMount();
  for (int tick = 0; tick < 9; ++tick) AddOdom(tick);
  RobotResults results = NewResults();
  Add(results, 1, true);
  EXPECT_THAT(Transforms(), IsEmpty());
  Add(results, 2);
  Add(results, 3, true);
  EXPECT_THAT(Transforms(), ElementsAre("2 map odom", "3 map odom"));
  const std::vector<ByteBuffer>& all = written[RobotTopic::kTransforms];
  EXPECT_TRUE(std::equal(all[0].begin() + 16, all[0].end(), all[1].begin() + 16, all[1].end()));
  EXPECT_EQ(Count(RobotTopic::kPose), 1U);
}

TEST_F(RobotResultsTest, ACameraAloneHasOneParent) {
  frames.publishes_camera = true;
  frames.tf_ahead_s = 0.2;
  RobotResults results = NewResults();
  Add(results, 1);
  EXPECT_THAT(Transforms(), ElementsAre("3 map camera"));
  transforms.Add({"gimbal", "camera", Rigid3(), 0}, true);
  Add(results, 2);
  EXPECT_THAT(Transforms(), ElementsAre("3 map camera"));
}

TEST_F(RobotResultsTest, TheMapIsWrittenWhenItHasChanged) {
  RobotResults results = NewResults();
  for (int tick = 0; tick < 30; ++tick) {
    if (tick < 15) ++map->version;
    Add(results, tick);
  }
  EXPECT_EQ(Count(RobotTopic::kPath), 3U) << "at 0 s and 1 s, and the last change";
  EXPECT_EQ(Count(RobotTopic::kObjects), 3U);
  EXPECT_EQ(Count(RobotTopic::kMarkers), 3U);
}

}  // namespace
}  // namespace oaslam
