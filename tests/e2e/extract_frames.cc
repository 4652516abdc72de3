// extract_frames VIDEO FOLDER FROM TO: frames of a video as grey images in a TUM folder (rgb.txt),
// for tests that damage one of them.

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/image_source.h"

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const std::filesystem::path folder = argv[2];
  std::filesystem::create_directories(folder / "rgb");
  oaslam::ImageSourceOptions options;
  options.from = std::atoi(argv[3]);
  options.to = std::atoi(argv[4]);
  const auto source = oaslam::OpenImages(argv[1], options);
  std::ofstream list(folder / "rgb.txt");
  while (const auto input = source->Next()) {
    const std::string name = fmt::format("rgb/{}.png", input->name);
    if (!cv::imwrite(folder / name, input->image, {cv::IMWRITE_PNG_COMPRESSION, 1})) return 1;
    list << fmt::format("{:.6f} {}\n", input->timestamp, name);
  }
  return 0;
}
