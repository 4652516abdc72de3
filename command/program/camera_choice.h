#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "common.h"
#include "oaslam/camera_estimation.h"
#include "oaslam/config.h"
#include "oaslam/storage/map_file.h"

namespace oaslam::apps {

// "auto", or nothing given.
inline bool IsAutoCamera(const std::string& spec) { return spec.empty() || spec == "auto"; }

struct CameraSettings {
  std::string camera;                // a file, fov:DEGREES or auto; empty: auto
  bool refine = false;               // the calibration, or the guess, is only a start value
  std::optional<Camera> recorded{};  // of a recording of ROS, where no other is given

  bool IsAuto() const { return IsAutoCamera(camera) && !recorded; }
  // Whether the camera is estimated from the images.
  bool IsEstimated() const { return IsAuto() || refine; }
};

// --camera, --refine-camera.
void AddCameraOptions(CLI::App& app, CameraSettings& settings);

// Throws InputError where images are too small for a neighbourhood of a point to lie in them.
void CheckImageSize(const cv::Size& size, const std::string& source);
// Also refuses a panorama, which no camera model fits. Throws InputError.
void CheckImage(const cv::Mat& image, const std::string& source);

// Throws InputError where the camera that a recording of ROS tells is of images of another size.
void CheckRecordedCamera(const Camera& camera, const cv::Size& size, const std::string& source);

// Estimates the camera of a source from its images, from as many parts of it as are needed; of a
// live source, from its first seconds. `known` is the start value if nothing better is given, such
// as the camera of a map; `mask` as for Slam::SetMask. Reports the result, and warns where the
// images do not determine the camera. Throws InputError as FrameInputs does.
CameraEstimate EstimateCamera(const CameraSettings& settings, const std::string& images,
                              const std::optional<Camera>& known, const cv::Mat& mask,
                              const SlamConfig& config, const CommonOptions& common);

// Refines an estimated camera by the whole map: bundle adjustment with its intrinsics, after which
// the map is converted to the new camera. Camera and map stay as they are where the map does not
// determine it. `find_readout`: also undoes a rolling shutter that the map shows.
void RefineWithMap(const SlamConfig& config, bool find_readout, CameraEstimate& camera,
                   SavedMap& saved);

}  // namespace oaslam::apps
