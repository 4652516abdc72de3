#include <cmath>

#include "fuzz.h"
#include "oaslam/formats/imu_file.h"
#include "oaslam/formats/imu_pose.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string path = fuzz::FileOf(fuzz::Text(data, size), "imu.csv");
  fuzz::Try([&] { LoadCameraFromImu(path); });
  // As a gyroscope, an accelerometer and both, by the same file.
  fuzz::Try([&] { LoadImu(path + "," + path); });
  return fuzz::Try([&] {
    const ImuRecording recording = LoadImu(path);
    for (size_t i = 0; i < recording.samples.size(); ++i) {
      const ImuSample& sample = recording.samples[i];
      if (i > 0 && !(sample.timestamp > recording.samples[i - 1].timestamp)) __builtin_trap();
      if (!(sample.angular_velocity.norm() <= 100) || !(sample.acceleration.norm() <= 1000))
        __builtin_trap();
    }
  });
}
