// Finds many images in a saved map, on all cores: localize_many MAP SOURCE [CAMERA]
// SOURCE: a folder of images, a list of them, or a video. CAMERA: a calibration or fov:DEGREES;
// without one, the focal length is estimated for each image.
#include <cstdio>
#include <deque>
#include <future>
#include <thread>

#include "oaslam/oaslam.h"

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: localize_many MAP SOURCE [CAMERA]\n"), 2;
  try {
    const oaslam::MapLocalizer localizer(argv[1]);
    const auto images = oaslam::OpenImages(argv[2], {});
    const auto find = [&](oaslam::InputImage image) {
      oaslam::RelocalizeOptions options;
      if (argc > 3) options.camera = oaslam::LoadCamera(argv[3], image.image.size());
      const auto found = localizer.Relocalize({.image = image.image}, options);
      return std::pair(std::move(image.name), found);
    };
    // As many images at a time as there are cores; the answers come in the order of the images.
    std::deque<std::future<std::pair<std::string, oaslam::RelocalizationResult>>> at_work;
    bool is_done = false;
    while (!is_done || !at_work.empty()) {
      while (!is_done && at_work.size() < std::max(1U, std::thread::hardware_concurrency())) {
        std::optional<oaslam::InputImage> image = images->Next();
        is_done = !image;
        if (image && !image->image.empty())
          at_work.push_back(std::async(std::launch::async, find, *std::move(image)));
      }
      if (at_work.empty()) break;
      const auto [name, result] = at_work.front().get();
      at_work.pop_front();
      if (const auto& pose = result.world_from_cam)
        std::printf("%s %.3f %.3f %.3f\n", name.c_str(), pose->translation.x(),
                    pose->translation.y(), pose->translation.z());
      else
        std::printf("%s not found: %s\n", name.c_str(), result.why_not.c_str());
    }
  } catch (const oaslam::InputError& error) {
    return std::fprintf(stderr, "localize_many: %s\n", error.what()), 1;
  }
}
