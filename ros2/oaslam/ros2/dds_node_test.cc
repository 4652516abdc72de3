#include "oaslam/ros2/dds_node.h"

#include <gmock/gmock.h>

#include "loopback.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

RecordedTopic TopicFor(const std::string& name, const std::string& type) {
  return {name, type, MessageEncoding::kCdr, "cdr"};
}

// Two nodes of this process, by the loopback interface alone, in a domain of their own.
struct DdsNodes : testing::Test {
  const uint32_t domain = LoopbackDomain();
  DdsNode one{domain}, other{domain};

  template <typename Done>
  bool Wait(Done done) {
    for (const double end = SteadySeconds() + kLoopbackPatience; SteadySeconds() < end;) {
      other.Wait(0.01);
      if (done()) return true;
    }
    return false;
  }
};

TEST_F(DdsNodes, HandOverBytes) {
  std::vector<ByteBuffer> heard;
  const int images = one.Publish("/cam/image", "sensor_msgs/Image", {});
  other.Read(TopicFor("/cam/image", "sensor_msgs/Image"), {},
             [&](const RecordedMessage& message, uint64_t publisher) {
               heard.emplace_back(message.data.begin(), message.data.end());
               EXPECT_THAT(other.Publishers("/cam/image"), testing::ElementsAre(publisher));
             });
  ASSERT_TRUE(Wait([&] { return other.Publishers("/cam/image").size() == 1; }));
  ASSERT_TRUE(Wait([&] { return one.CountSubscribers(images) == 1; }));
  std::vector<ByteBuffer> sent;
  for (const size_t size : {5, 6, 1000, 100'001, 3'000'000}) {
    ByteBuffer bytes(size);
    for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(i * 7 + i / 251);
    std::ranges::copy(std::array<uint8_t, 4>{0, 1, 0, 0}, bytes.begin());
    one.Write(images, bytes);
    sent.push_back(std::move(bytes));
    ASSERT_TRUE(Wait([&] { return heard.size() == sent.size(); })) << size;
    // Up to three bytes may follow.
    ASSERT_GE(heard.back().size(), size);
    ASSERT_LE(heard.back().size(), size + 3);
    heard.back().resize(size);
    EXPECT_TRUE(heard.back() == sent.back()) << size;
  }
}

TEST_F(DdsNodes, SeeWhatOthersPublish) {
  one.Publish("/cam/image", "sensor_msgs/Image", {.is_reliable = false});
  one.Publish("/imu", "sensor_msgs/Imu", {});
  ASSERT_TRUE(Wait([&] { return other.Publications().size() == 2; }));
  const std::vector<Publication> all = other.Publications();
  const bool is_first = all[0].topic == "/cam/image";
  const Publication &image = all[is_first ? 0 : 1], &imu = all[is_first ? 1 : 0];
  EXPECT_EQ(image.type, "sensor_msgs/Image");
  EXPECT_FALSE(image.is_reliable);
  EXPECT_EQ(imu.topic, "/imu");
  EXPECT_TRUE(imu.is_reliable);
  EXPECT_TRUE(one.Publications().empty()) << "its own";
}

TEST_F(DdsNodes, ForgetThoseThatHaveGone) {
  const auto is_there = [&](const std::string& topic) {
    const std::vector<Publication> all = other.Publications();
    return std::ranges::any_of(all, [&](const Publication& p) { return p.topic == topic; });
  };
  for (const std::string topic : {"/a", "/b", "/c"}) {
    {
      DdsNode brief(domain);
      brief.Publish(topic, "sensor_msgs/Imu", {});
      ASSERT_TRUE(Wait([&] { return is_there(topic); }));
    }
    ASSERT_TRUE(Wait([&] { return !is_there(topic); }));
  }
}

TEST_F(DdsNodes, GiveLatchedMessagesToThoseWhoComeLater) {
  const int path = one.Publish("/path", "nav_msgs/Path", {.is_latched = true, .depth = 1});
  for (const uint8_t number : {uint8_t{1}, uint8_t{2}})
    one.Write(path, ByteBuffer{0, 1, 0, 0, number, 0, 0, 0});
  std::vector<int> heard, of_other_type;
  other.Read(TopicFor("/path", "nav_msgs/Path"), {.is_latched = true},
             [&](const RecordedMessage& message, uint64_t) { heard.push_back(message.data[4]); });
  DdsNode third(domain);
  third.Read(TopicFor("/path", "nav_msgs/Odometry"), {.is_latched = true},
             [&](const RecordedMessage&, uint64_t) { of_other_type.push_back(1); });
  bool third_hears = false;
  third.Read(TopicFor("/imu", "sensor_msgs/Imu"), {.is_latched = true},
             [&](const RecordedMessage&, uint64_t) { third_hears = true; });
  one.Write(one.Publish("/imu", "sensor_msgs/Imu", {.is_latched = true, .depth = 1}),
            ByteBuffer{0, 1, 0, 0, 1, 0, 0, 0});
  ASSERT_TRUE(Wait([&] {
    third.Wait(0.01);
    return !heard.empty() && third_hears;
  }));
  EXPECT_THAT(heard, testing::ElementsAre(2));
  EXPECT_THAT(of_other_type, testing::IsEmpty());
}

}  // namespace
}  // namespace oaslam
