// odometry_estimates VIDEO CAMERA SAMPLES FOLDER: what the odometry tells of each image of a video,
// through the interface that the module for browsers has (bindings/wasm/odometry_js.h). Writes to
// FOLDER the grey images (images), their time stamps (times) and, for each, the estimate and its
// points (estimates), all as this processor keeps them; and the ORB key points of each fiftieth
// (features). SAMPLES: the number of their columns, and of a gyroscope four doubles each, of an IMU
// seven.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "oaslam/camera_file.h"
#include "oaslam/image_source.h"
#include "odometry_js.h"

namespace {

std::vector<double> ReadDoubles(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> bytes(std::istreambuf_iterator<char>(file), {});
  std::vector<double> doubles(bytes.size() / sizeof(double));
  std::copy_n(bytes.begin(), doubles.size() * sizeof(double),
              reinterpret_cast<char*>(doubles.data()));
  return doubles;
}

void Write(std::ofstream& file, const void* data, size_t size) {
  file.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  const oaslam::Camera c = oaslam::LoadCamera(argv[2]);
  const auto& k = c.distortion;
  OaslamOdometry* odometry =
      oaslam_odometry_new(c.model == oaslam::LensModel::kFisheye, c.width, c.height, c.fx, c.fy,
                          c.cx, c.cy, k[0], k[1], k[2], k[3], k[4], 0);
  const std::vector<double> samples = ReadDoubles(argv[3]);
  const auto columns = static_cast<int>(samples.at(0));
  const std::filesystem::path folder = argv[4];
  std::ofstream images(folder / "images", std::ios::binary),
      times(folder / "times", std::ios::binary), estimates(folder / "estimates", std::ios::binary),
      features(folder / "features", std::ios::binary);
  std::vector<double> ms;
  const auto source = oaslam::OpenImages(argv[1], {});
  auto sample = samples.begin() + 1;
  while (const auto input = source->Next()) {
    const double time_s = input->timestamp;
    const cv::Mat grey = input->image.isContinuous() ? input->image : input->image.clone();
    const size_t pixels = grey.total();
    // Those up to a tenth of a second after the image; odometry_module.mjs gives the same.
    auto end = sample;
    while (end != samples.end() && *end <= time_s + 0.1) end += columns;
    const int count = static_cast<int>(end - sample) / columns;
    const auto start = std::chrono::steady_clock::now();
    std::copy_n(grey.data, pixels, oaslam_odometry_image(odometry));
    std::copy(sample, end, oaslam_odometry_samples(odometry, count, columns));
    sample = end;
    const OaslamEstimate* estimate = oaslam_odometry_process(odometry, time_s, 0, count);
    if (!estimate) {
      fmt::print(stderr, "{}\n", oaslam_odometry_problem(odometry));
      return 1;
    }
    const std::chrono::duration<double, std::milli> taken =
        std::chrono::steady_clock::now() - start;
    ms.push_back(taken.count());
    Write(images, grey.data, pixels);
    Write(times, &time_s, sizeof(time_s));
    Write(estimates, estimate, sizeof(*estimate));
    Write(estimates, oaslam_odometry_points(odometry), 12 * static_cast<size_t>(estimate->points));
    if (ms.size() % 50 != 1) continue;
    const int keypoints = oaslam_odometry_features(odometry, 1000);
    constexpr size_t kBytes = 45;  // of a key point: x, y, angle, octave and descriptor
    Write(features, &keypoints, sizeof(keypoints));
    Write(features, oaslam_odometry_feature_bytes(odometry), kBytes * keypoints);
  }
  oaslam_odometry_delete(odometry);
  std::ranges::sort(ms);
  if (ms.empty()) return 1;
  fmt::print("native: {:.2f} ms an image (median), {:.2f} (99 %)\n", ms[ms.size() / 2],
             ms[ms.size() * 99 / 100]);
  return 0;
}
