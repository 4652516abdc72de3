#include "dataset_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "camera_choice.h"
#include "frame_inputs.h"
#include "oaslam/formats/imu_pose.h"
#include "oaslam/formats/time_unit.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/dataset.h"
#include "oaslam/images/image_list.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

// Who reads the images says what there is to say of them.
ImageSourceOptions Quietly(const CommonOptions& common) {
  ImageSourceOptions options = FrameRange(common);
  options.quiet = true;
  return options;
}

// Whether a calibration tells how the camera lies to the IMU.
bool KnowsImu(const std::string& camera) {
  return !IsAutoCamera(camera) && LoadCameraFromImu(camera).has_value();
}

// Takes the IMU, also where it is given by its path: its clock and axes are the dataset's.
void TakeImu(const Dataset& dataset, const std::string& camera, SideFiles& side,
             std::vector<std::string>& taken) {
  std::error_code error;
  const bool is_given = std::filesystem::equivalent(side.imu, dataset.imu, error);
  if (dataset.imu.empty() || !(is_given || side.imu.empty())) return;
  if (!is_given && !dataset.cam_from_imu && !KnowsImu(camera)) {
    taken.push_back(dataset.imu + " not, since no calibration tells how it lies (T_cam_imu)");
    return;
  }
  side.imu = dataset.imu;
  side.imu_begin_s = dataset.imu_begin_s;
  side.cam_from_imu = dataset.cam_from_imu;
  side.imu_may_fail = !is_given;
  taken.push_back("IMU " + dataset.imu);
}

// The poses at the times of the images to which they belong by name.
std::vector<StampedPose> AtTimes(const std::vector<NamedPose>& poses, const std::string& path,
                                 const CommonOptions& common, const std::string& source) {
  const auto images =
      source.empty() ? std::vector<ListedImage>() : TimesOfImages(source, Quietly(common));
  std::string problem = "give the images of what is compared with it (--images), or a map file";
  if (!images.empty()) {
    try {
      return AtTimesOf(images, poses, path);
    } catch (const InputError& error) {
      problem = error.what();
    }
  }
  std::vector<std::string> names;
  for (const NamedPose& pose : poses) names.push_back(pose.name);
  const auto times = TimesOfNames(names);
  if (!times && images.empty())
    throw BadInput("{}: its poses have names of images, and no times: {}", path, problem);
  if (!times) throw InputError(problem);
  std::vector<StampedPose> found;
  for (size_t i = 0; i < poses.size(); ++i)
    found.push_back({times->seconds[i], poses[i].world_from_cam});
  std::ranges::sort(found, {}, &StampedPose::timestamp);
  return found;
}

}  // namespace

void TakeDataset(const std::string& images, const CommonOptions& common, const FromDataset& into) {
  if (images.empty() || IsCamera(images)) return;
  const std::optional<Dataset> dataset = FindDataset(images, Quietly(common));
  if (!dataset) return;
  std::vector<std::string> taken = {dataset->film.empty()
                                        ? fmt::format("{} images", dataset->images.size())
                                        : "images of " + dataset->film};
  if (into.camera && into.camera->empty()) {
    *into.camera = dataset->camera;
    taken.push_back(dataset->camera.empty() ? "no camera is in it" : "camera " + dataset->camera);
  }
  if (into.camera && into.side) TakeImu(*dataset, *into.camera, *into.side, taken);
  if (into.depth && dataset->depth) {
    *into.depth = dataset->depth;
    taken.push_back(fmt::format("{} depth images", dataset->depth->files.size()));
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

std::vector<StampedPose> LoadGroundtruth(const std::string& path, const CommonOptions& common,
                                         const std::string& images) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return LoadTrajectory(path);
  CommonOptions any = common;
  any.dataset.clear();
  any.follow_s.reset();
  const std::optional<Dataset> dataset = FindTruth(path, Quietly(any));
  if (!dataset || !dataset->truth)
    throw BadInput(
        "{}: is a folder {}; give the file of the ground truth", path,
        dataset ? "of " + dataset->layout + " without a ground truth" : "in no known layout");
  // A rate that is given without images is that of the images in the folder.
  if (!dataset->named_truth || (images.empty() && common.fps)) return dataset->truth();
  return AtTimes(dataset->named_truth(), path, common, images);
}

}  // namespace oaslam::apps
