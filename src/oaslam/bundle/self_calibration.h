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

// What is assumed of a camera before its images are seen. Lenses of one kind differ little: the
// principal point of a phone is off by about 1 % of the image, and a strongly distorting wide lens
// has a k1 of about -0.3.
struct CalibrationPrior {
  // Around which the other parameters are expected; without: the camera that the map has.
  std::optional<Camera> camera{};
  // Relative; infinite: the focal length is not known at all.
  double focal_sigma = std::numeric_limits<double>::infinity();
  double center_sigma = 0.01;  // of the longer side of the image
  double k1_sigma = 0.2, k2_sigma = 0.2;
  // Of the readout of a rolling shutter, from top to bottom, about none; 0: there is none.
  double readout_sigma_s = 0;
};

// A camera as a map has it.
struct SelfCalibration {
  // The images determine the focal length; else `why_not`, and the camera is the best guess.
  bool success = false;
  std::string why_not;
  Camera camera;
  // 1 sigma, with the correlation of errors between neighbours in an image, and enlarged by how
  // much parts of the walk differ; infinite: not determined.
  double focal_sigma_px = std::numeric_limits<double>::infinity();
  double center_sigma_px = 0, k1_sigma = 0, k2_sigma = 0;
  double readout_s = 0, readout_sigma_s = 0;  // of a rolling shutter, where it was asked for
  double parts_ratio = 1;                     // by which it was enlarged
  double rmse = 0;                            // of the inliers, in units of the key points' scale
  int keyframes = 0, observations = 0, inliers = 0;
  std::vector<std::pair<KeyframeId, Rigid3>> poses;            // of the keyframes used, ascending
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> points;  // of the landmarks used, ascending

  double RelativeSigma() const { return focal_sigma_px / camera.fx; }
};

// Focal length, principal point and radial distortion of a camera of the map (an index into
// Map::cameras), from the keyframes that it took: bundle adjustment in the original image, from the
// camera that the map has. The ratio of the focal lengths and the other coefficients stay. Refused,
// not guessed, where the motion leaves the focal length open: turning on the spot, moving without
// turning, and anything else by which its standard deviation stays above 2 %. `trajectory`
// tells how the camera moved while it read out its images.
SelfCalibration SelfCalibrate(const Map& map, int camera, const CalibrationPrior& prior = {},
                              std::span<const FramePose> trajectory = {});

// The same in a third of the time, without a look at parts of the walk: the standard deviation is
// that of one map, which can be bent as a whole.
SelfCalibration SelfCalibrateQuickly(const Map& map, int camera, const CalibrationPrior& prior = {},
                                     std::span<const FramePose> trajectory = {});

// The map with that camera, after a global bundle adjustment of everything with it.
Map Recalibrated(const Map& map, int camera, const SelfCalibration& calibration,
                 const BundleConfig& config, int min_shared_landmarks);

}  // namespace oaslam
