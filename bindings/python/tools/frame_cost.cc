// Maps a video from memory: frame_cost VIDEO CAMERA DETECTIONS FRAMES TRAJECTORY. Prints the CPU
// seconds of the loop over the images (tools/python_overhead has the same in Python).
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "oaslam/oaslam.h"

int main(int argc, char** argv) {
  if (argc != 6)
    return std::fprintf(stderr, "usage: frame_cost VIDEO CAMERA DETECTIONS FRAMES TRAJECTORY\n"), 2;
  const auto source = oaslam::OpenImages(argv[1], {.to = std::atoi(argv[4])});
  std::vector<oaslam::InputImage> images;
  while (std::optional<oaslam::InputImage> image = source->Next()) images.push_back(*image);
  const oaslam::DetectionTable detections = oaslam::LoadDetections(argv[3]);
  oaslam::SlamConfig config = oaslam::SlamConfig::Offline();
  config.runner.mode = oaslam::RunnerMode::kSequential;
  oaslam::Slam slam(config, oaslam::LoadCamera(argv[2], images.front().image.size()));
  double depth = 0;
  const std::clock_t start = std::clock();
  for (const oaslam::InputImage& image : images) {
    const oaslam::TrackingResult result = slam.Process({.image = image.image,
                                                        .timestamp = image.timestamp,
                                                        .detections = detections.Find(image.name)});
    if (const auto pose = result.PoseIn(result.world)) depth += pose->translation.z();
  }
  const double seconds = double(std::clock() - start) / CLOCKS_PER_SEC;
  oaslam::SaveTrajectory(argv[5], slam.Trajectory());
  std::printf("%.6f %.9f\n", seconds, depth);
}
