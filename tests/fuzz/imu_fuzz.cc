#include "fuzz.h"
#include "oaslam/formats/imu_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string path = fuzz::FileOf(fuzz::Text(data, size), "imu.csv");
  fuzz::Try([&] { LoadCameraFromImu(path); });
  return fuzz::Try([&] {
    const auto samples = LoadImu(path, Eigen::Quaterniond::Identity());
    for (size_t i = 1; i < samples.size(); ++i)
      if (!(samples[i].timestamp > samples[i - 1].timestamp)) __builtin_trap();
  });
}
