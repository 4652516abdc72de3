#include "fuzz.h"
#include "oaslam/trajectory_file.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace oaslam;
  const std::string path = fuzz::FileOf(fuzz::Text(data, size), "trajectory.txt");
  fuzz::Try([&] { LoadScoredPoses(path); });
  return fuzz::Try([&] {
    // What has been read can be written and read again.
    const auto poses = LoadTrajectory(path);
    SaveTrajectory(path, poses);
    if (LoadTrajectory(path).size() != poses.size()) __builtin_trap();
  });
}
