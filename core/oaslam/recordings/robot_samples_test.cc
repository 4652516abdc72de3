#include <gtest/gtest.h>

#include <map>

#include "oaslam/recordings/topic_choice.h"
#include "oaslam_data.h"

namespace oaslam {
namespace {

// Recordings that were made by the writers of others (rosbag, @mcap/core, @foxglove's CDR, SQLite):
// a folder beside OASLAM_DATA.
std::string Sample(const std::string& name) {
  return (testing::FindData("../robots").value_or("") / name).string();
}

// The numbers of images, of CameraInfos and of samples of the IMU.
struct SampleCounts {
  const char* name;
  size_t images, infos, imu;
};
constexpr SampleCounts kSamples[] = {{"bags/sample.bag", 90, 90, 300},
                                     {"bags/sample_lz4.bag", 8, 8, 27},
                                     {"bags/sample_bz2.bag", 8, 8, 27},
                                     {"bags/no_camera_info.bag", 6, 0, 0},
                                     {"bags/zero_stamps.bag", 6, 6, 20},
                                     {"bags/unindexed.bag", 6, 6, 20},
                                     {"bags/truncated.bag", 2, 3, 8},
                                     {"ros2/sample.mcap", 90, 90, 300},
                                     {"ros2/sample_lz4.mcap", 8, 8, 27},
                                     {"ros2/sample_nochunks.mcap", 6, 6, 20},
                                     {"ros2/sample_ros1.mcap", 10, 10, 34},
                                     {"ros2/no_camera_info.mcap", 4, 0, 0},
                                     {"ros2/zero_stamps.mcap", 4, 4, 14},
                                     {"ros2/unfinished.mcap", 12, 13, 41},
                                     {"ros2/truncated.mcap", 4, 5, 15},
                                     {"ros2/wrong_array_length.mcap", 4, 4, 14},
                                     {"ros2/sample", 90, 90, 300},
                                     {"ros2/sample_split", 12, 12, 40},
                                     {"ros2/sample_zstd_file", 6, 6, 20},
                                     {"ros2/sample_zstd_message", 6, 6, 20},
                                     {"ros2/killed", 3, 0, 0},
                                     {"ros2/no_camera_info", 3, 0, 0},
                                     {"ros2/zero_stamps", 3, 3, 10},
                                     {"ros2/wrong_length", 3, 3, 10}};

TEST(RobotSamples, HaveWhatWasWritten) {
  OASLAM_SKIP_WITHOUT_DATA("../robots");
  for (const SampleCounts& sample : kSamples) {
    const auto summary = SummaryOf(Sample(sample.name));
    const auto count = [&](const char* topic) -> size_t {
      const TopicSummary* found = summary->Find(topic);
      return found ? found->messages : 0;
    };
    EXPECT_EQ(count("/camera/image_raw/compressed"), sample.images) << sample.name;
    EXPECT_EQ(count("/camera/camera_info"), sample.infos) << sample.name;
    EXPECT_EQ(count("/imu/data"), sample.imu) << sample.name;
    const TopicSummary& images = *summary->Find("/camera/image_raw/compressed");
    const bool has_stamps = std::string(sample.name).find("zero_stamps") == std::string::npos;
    EXPECT_EQ(images.without_stamp, has_stamps ? 0 : sample.images) << sample.name;
    EXPECT_NEAR(images.times.at(1), 1.7e9 + 1.0 / 30 + (has_stamps ? 0 : 0.008), 1e-6)
        << sample.name;
    const auto camera = CameraOf(*summary, images);
    ASSERT_EQ(camera.has_value(), sample.infos > 0) << sample.name;
    if (camera) {
      EXPECT_EQ(camera->fx, 262.5) << sample.name;
    }
  }
}

// The bytes of the first image, which all have.
TEST(RobotSamples, HaveTheSameImageAndImu) {
  OASLAM_SKIP_WITHOUT_DATA("../robots");
  const auto sample_imu = SummaryOf(Sample(kSamples[0].name));
  std::string first;
  for (const SampleCounts& sample : kSamples) {
    const std::string path = Sample(sample.name);
    if (path.ends_with("wrong_length") || path.ends_with("wrong_array_length.mcap")) continue;
    const auto reader = OpenRecording(path, [](const RecordedTopic&) { return kWholeMessage; });
    std::string bytes;
    while (const auto message = reader->Next())
      if (message->topic->type == "sensor_msgs/CompressedImage") {
        const ByteView data = ReadRosCompressedImage(*message, false).data;
        bytes.assign(data.begin(), data.end());
        break;
      }
    ASSERT_GT(bytes.size(), 5000U);
    if (first.empty()) first = bytes;
    EXPECT_EQ(bytes, first) << path;
    if (sample.imu == 0) continue;
    const auto summary = SummaryOf(path);
    const TopicSummary &imu = *summary->Find("/imu/data"), &known = *sample_imu->Find("/imu/data");
    EXPECT_EQ(imu.gyroscope.values.at(3), known.gyroscope.values.at(3)) << path;
    EXPECT_EQ(imu.accelerometer.values.at(3), known.accelerometer.values.at(3)) << path;
  }
}

}  // namespace
}  // namespace oaslam
