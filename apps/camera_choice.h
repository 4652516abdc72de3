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
  std::string camera;   // a file, fov:DEGREES or auto; empty: auto
  bool refine = false;  // the calibration, or the guess, is only a start

  bool IsAuto() const { return IsAutoCamera(camera); }
  // From the images.
  bool IsEstimated() const { return IsAuto() || refine; }
};

// --camera, --refine-camera.
void AddCameraOptions(CLI::App& app, CameraSettings& settings);

// The camera of a source, from its images alone: as many parts of it as are needed, of a live one
// its first seconds. `known` is where an estimate begins if nothing better is given, such as the
// camera of a map. Says what it found, and warns where the images do not tell. Throws InputError as
// FrameInputs.
CameraEstimate EstimateCamera(const CameraSettings& settings, const std::string& images,
                              const std::optional<Camera>& known, const SlamConfig& config,
                              const CommonOptions& common);

// The last word on an estimated camera, from the whole map: bundle adjustment with its intrinsics,
// and all that follows from it brought in line. `camera` and the map stay where the map does not
// tell. `find_readout`: a rolling shutter that the map shows is undone, too.
void RefineWithMap(const SlamConfig& config, bool find_readout, CameraEstimate& camera,
                   SavedMap& saved);

}  // namespace oaslam::apps
