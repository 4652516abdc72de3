#include "dataset_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <filesystem>
#include <optional>

#include "camera_choice.h"
#include "oaslam/formats/imu_file.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/dataset.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

std::optional<Dataset> FindQuietly(const std::string& folder, const CommonOptions& common) {
  if (folder.empty() || IsCamera(folder)) return std::nullopt;
  ImageSourceOptions options = FrameRange(common);
  options.quiet = true;  // who reads the images says it
  return FindDataset(folder, options);
}

// Whether a calibration tells how the camera lies to the gyroscope.
bool KnowsGyroscope(const std::string& camera) {
  return !IsAutoCamera(camera) && LoadCameraFromImu(camera).has_value();
}

}  // namespace

void TakeDataset(const std::string& images, const CommonOptions& common, const FromDataset& into) {
  const std::optional<Dataset> dataset = FindQuietly(images, common);
  if (!dataset) return;
  std::vector<std::string> taken = {dataset->film.empty()
                                        ? fmt::format("{} images", dataset->images.size())
                                        : "images of " + dataset->film};
  if (into.camera && into.camera->empty()) {
    *into.camera = dataset->camera;
    taken.push_back(dataset->camera.empty() ? "no camera is in it" : "camera " + dataset->camera);
  }
  if (into.camera && into.imu && into.imu->empty() && !dataset->imu.empty() &&
      KnowsGyroscope(*into.camera)) {
    *into.imu = dataset->imu;
    taken.push_back("gyroscope " + dataset->imu);
  }
  if (into.truth && into.truth->empty() && dataset->truth) {
    try {
      *into.truth = dataset->truth();
    } catch (const InputError& error) {
      spdlog::warn("{} (the ground truth of {}, left out)", error.what(), dataset->layout);
    }
    if (!into.truth->empty()) taken.push_back(fmt::format("{} true poses", into.truth->size()));
  }
  spdlog::info("{}: taken for {} (--dataset): {}", images, dataset->layout, fmt::join(taken, ", "));
}

std::vector<StampedPose> LoadGroundtruth(const std::string& path, const CommonOptions& common) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return LoadTrajectory(path);
  CommonOptions any = common;
  any.dataset.clear();
  any.follow_s.reset();
  const std::optional<Dataset> dataset = FindQuietly(path, any);
  if (!dataset || !dataset->truth)
    throw BadInput(
        "{}: is a folder {}; give the file of the ground truth", path,
        dataset ? "of " + dataset->layout + " without a ground truth" : "in no known layout");
  return dataset->truth();
}

}  // namespace oaslam::apps
