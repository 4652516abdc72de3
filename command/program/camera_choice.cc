#include "camera_choice.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core/utility.hpp>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/bundle/rolling_shutter.h"
#include "oaslam/bundle/self_calibration.h"
#include "oaslam/camera_file.h"
#include "oaslam/image_source.h"
#include "oaslam/images/camera_source.h"
#include "oaslam/images/panorama.h"
#include "oaslam/map/camera_replacement.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/uri.h"
#include "readable_images.h"

namespace oaslam::apps {
namespace {

// How many parts of a recorded source are tried: each costs as much as to map it.
constexpr int kMaxParts = 3;
// How much of a live source is used: nothing is mapped before, so that it must be short.
constexpr double kLiveSeconds = 10;

// Undoes a rolling shutter if the map shows one; returns its readout time in seconds, else 0.
double UndoReadout(const SlamConfig& config, int camera, SavedMap& saved) {
  const SelfCalibrationOptions quickly{.readout_sigma_s = 0.02, .compares_parts = false};
  const SelfCalibration found = SelfCalibrate(saved.map, camera, quickly, saved.trajectory);
  if (found.SureReadout() == 0) return 0;
  const Map with = Recalibrated(saved.map, camera, found, config.bundle);
  saved.map = WithoutReadout(with, saved.trajectory, found.readout_s, config.bundle);
  const SelfCalibration rest = SelfCalibrate(saved.map, camera, quickly, saved.trajectory);
  spdlog::debug("rolling shutter: {:.2f} +- {:.2f} ms, left {:.2f}, residuals {:.3f}, then {:.3f}",
                1000 * found.readout_s, 1000 * found.readout_sigma_s, 1000 * rest.readout_s,
                found.rmse, rest.rmse);
  return found.readout_s;
}

// Converts the other submaps to the camera of the map, and undoes the rolling shutter in them.
void BringAlong(const SlamConfig& config, int camera, double readout_s, SavedMap& saved) {
  constexpr int kIterations = 20;  // at most: it begins near the optimum
  for (Submap& submap : saved.submaps) {
    submap.map = WithCamera(submap.map, camera, saved.map.cameras[static_cast<size_t>(camera)]);
    if (readout_s != 0)
      submap.map = WithoutReadout(submap.map, submap.trajectory, readout_s, config.bundle);
    else
      ApplyCorrection(GlobalBundleAdjustment(submap.map, kIterations, config.bundle), submap.map);
    RefitMovedObjects(config.objects, submap.map);
  }
}

// Refines the camera by the whole map, and converts the map to it.
void Refine(const SlamConfig& config, int index, CameraEstimate& camera, SavedMap& saved) {
  constexpr double kMaxRelativeSigma = 0.02;  // the bound of SelfCalibrate
  SelfCalibration found = SelfCalibrate(saved.map, index);
  camera.why_not = found.why_not;
  if (!found.success) return;
  // The difference between two maps of the same images is a lower bound on the standard deviation.
  found.focal_sigma_px =
      std::max(found.focal_sigma_px, std::abs(found.camera.fx - camera.camera.fx));
  camera.is_determined = found.RelativeSigma() < kMaxRelativeSigma;
  if (!camera.is_determined)
    camera.why_not = fmt::format("maps of the same images differ by {:.1f} % in the focal length",
                                 100 * found.RelativeSigma());
  found.camera.is_guess = !camera.is_determined;
  found.camera.focal_sigma = camera.is_determined ? 0 : std::min(1.0, found.RelativeSigma());
  ImageTime now;
  if (!saved.trajectory.empty())
    now = {saved.trajectory.back().frame_index, saved.trajectory.back().timestamp};
  saved.map = Recalibrated(saved.map, index, found, config.bundle);
  UpdateObjects(saved.map, {}, now, config.objects);
  camera.camera = found.camera;
  camera.focal_sigma_px = found.focal_sigma_px;
  camera.rmse = found.rmse;
}

}  // namespace

void AddCameraOptions(CLI::App& app, CameraSettings& settings) {
  app.add_option(
      "--camera", settings.camera,
      "calibration file, fov:DEGREES for a guess, or auto (default): estimated from the images");
  app.add_flag("--refine-camera", settings.refine,
               "use --camera as a start value, and estimate the camera from the images");
}

void CheckImageSize(const cv::Size& size, const std::string& source) {
  constexpr int kLeast = 33;  // pixels: the odometry's border at both sides, and one between
  if (std::min(size.width, size.height) < kLeast)
    throw BadInput("{}: images of {} x {}, allowed: {} pixels or more at each side", source,
                   size.width, size.height, kLeast);
}

void CheckImage(const cv::Mat& image, const std::string& source) {
  CheckImageSize(image.size(), source);
  if (IsPanorama(image))
    throw BadInput(
        "{}: is a panorama of 360 degrees (2:1, its left and right edges meet): cut it into views "
        "of a camera first, such as ffmpeg -i IN -vf "
        "v360=e:flat:h_fov=90:v_fov=90:w={}:h={}:yaw=0 OUT",
        WithoutPassword(source), image.cols / 4, image.cols / 4);
}

void CheckRecordedCamera(const Camera& camera, const cv::Size& size, const std::string& source) {
  if (camera.width != size.width || camera.height != size.height)
    throw BadInput(
        "{}: its CameraInfo is of images of {} x {}, but they have {} x {}; --camera gives another "
        "calibration, or auto",
        source, camera.width, camera.height, size.width, size.height);
}

CameraEstimate EstimateCamera(const CameraSettings& settings, const std::string& images,
                              const std::optional<Camera>& known, const cv::Mat& mask,
                              const SlamConfig& config, const CommonOptions& common) {
  cv::setNumThreads(1);
  const bool is_live = IsCamera(images);
  ImageSourceOptions range = FrameRange(common);
  range.quiet = true;  // the run that follows opens the same images
  // FrameInputs warns of what is skipped.
  ReadableImages source(OpenImages(images, range),
                        {.is_live = is_live || range.follow, .says = false});
  std::optional<InputImage> image = source.Next();
  if (!image && Interrupted()) return {};
  if (!image) throw source.NoneReadable(images);
  CheckImage(image->image, images);
  CameraEstimationOptions options{.mask = mask};
  if (settings.recorded) {
    CheckRecordedCamera(*settings.recorded, image->image.size(), images);
    options.start = settings.recorded;
  } else if (!settings.IsAuto()) {
    options.start = LoadCamera(settings.camera, image->image.size());
  } else if (known && known->width == image->image.cols && known->height == image->image.rows) {
    options.start = known;
  }
  if (!is_live) options.focal_length_35mm = FocalLength35mm(images);
  spdlog::info("camera: estimating its focal length from the images");
  CameraEstimator estimator(config, options);
  CameraEstimate estimate;
  const int parts = is_live ? 1 : kMaxParts;
  for (int part = 0; part < parts && image; ++part) {
    estimator.Forget();
    while (image && !estimator.IsFull() && !(is_live && estimator.Duration() > kLiveSeconds)) {
      estimator.Add(image->image, image->timestamp);
      image = source.Next();
    }
    CameraEstimate found = estimator.Estimate();
    if (part == 0 || found.is_determined || found.focal_sigma_px < estimate.focal_sigma_px)
      estimate = std::move(found);
    if (estimate.is_determined) break;
  }
  if (estimate.is_determined)
    spdlog::info("camera: {}, estimated from {} images", Describe(estimate), estimate.images);
  else
    spdlog::warn("camera: not determined by the images: {}; goes on with a guess: {}",
                 estimate.why_not, Describe(estimate));
  return estimate;
}

void RefineWithMap(const SlamConfig& config, bool find_readout, CameraEstimate& camera,
                   SavedMap& saved) {
  const auto place = std::ranges::find(saved.map.cameras, camera.camera);
  if (place == saved.map.cameras.end()) return;
  const int index = static_cast<int>(place - saved.map.cameras.begin());
  camera.readout_s = find_readout ? UndoReadout(config, index, saved) : 0;
  Refine(config, index, camera, saved);
  BringAlong(config, index, camera.readout_s, saved);
}

}  // namespace oaslam::apps
