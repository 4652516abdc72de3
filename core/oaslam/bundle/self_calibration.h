#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/camera.h"
#include "oaslam/map/map.h"

namespace oaslam {

struct SelfCalibrationOptions {
  // The mean of the prior of principal point and distortion; if it is absent, the camera of the
  // map. The focal length has no prior.
  std::optional<Camera> expected{};
  // Prior standard deviation of the readout time of a rolling shutter, around 0; 0: there is no
  // rolling shutter.
  double readout_sigma_s = 0;
  // Compares parts of the recording to estimate the standard deviation. Without this comparison the
  // calibration takes a third of the time, and its standard deviation is that of one map, whose
  // shape can be bent as a whole.
  bool compares_parts = true;
};

struct SelfCalibration {
  // Whether the images determine the focal length; if not, `why_not` tells why, and `camera` is the
  // best guess.
  bool success = false;
  std::string why_not;
  Camera camera;
  // 1 sigma; it accounts for correlated errors of neighbouring points in an image, and for how much
  // the calibrations by parts of the recording differ (if these were compared). Infinite: not
  // determined.
  double focal_sigma_px = std::numeric_limits<double>::infinity();
  double readout_s = 0, readout_sigma_s = 0;  // of a rolling shutter, where it was estimated
  double rmse = 0;                            // of the inliers, in units of the key points' scale
  int keyframes = 0, observations = 0, inliers = 0;
  std::vector<std::pair<KeyframeId, Rigid3>> poses;            // of the keyframes used, ascending
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> points;  // of the landmarks used, ascending

  double RelativeSigma() const { return focal_sigma_px / camera.fx; }
  // The readout time of a rolling shutter in seconds, where it is too long to be an error of the
  // estimate; else 0.
  double SureReadout() const;
};

// Estimates focal length, principal point and radial distortion of a camera of the map (an index
// into Map::cameras) from its keyframes, and from those of the same lens with another zoom, by
// bundle adjustment in the original image that starts from the map's camera. The ratio of the focal
// lengths and the other coefficients stay. It fails where the motion does not determine the focal
// length: turning on the spot, moving without turning, or whatever else leaves its standard
// deviation above 2 %. `trajectory` gives the motion of the camera while it read out its images.
SelfCalibration SelfCalibrate(const Map& map, int camera,
                              const SelfCalibrationOptions& options = {},
                              std::span<const FramePose> trajectory = {});

// The map with the calibrated camera, after a global bundle adjustment.
Map Recalibrated(const Map& map, int camera, const SelfCalibration& calibration,
                 const BundleConfig& config);

}  // namespace oaslam
