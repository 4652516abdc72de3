#pragma once

#include <limits>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "oaslam/camera.h"
#include "oaslam/config.h"

namespace oaslam {

struct CameraEstimationOptions {
  // The camera to start from: a rough calibration, or that of another run.
  std::optional<Camera> start;
  // As cameras and phones write it with an image, for film of 36 x 24 mm; a hint to start from.
  std::optional<double> focal_length_35mm;
};

// What the images tell of the camera that took them.
struct CameraEstimate {
  Camera camera;               // the best there is, in any case
  bool is_determined = false;  // the images determine it; else a guess, and `why_not`
  // 1 sigma; infinite where it is a guess.
  double focal_sigma_px = std::numeric_limits<double>::infinity();
  std::string why_not;
  // In which the camera reads out an image from its top row to its bottom row (below 0: upwards);
  // 0: at once, or not known.
  double readout_s = 0;
  int images = 0;   // that it is from
  double rmse = 0;  // of the points, in units of their scale
};

// The camera of images whose calibration is not known: maps parts of them with a guess of the focal
// length, calibrates the camera by the map, and begins again with what it found until that stays.
// The same images give the same answer. Images are kept, scaled down where they are large.
class CameraEstimator {
 public:
  explicit CameraEstimator(const SlamConfig& config, const CameraEstimationOptions& options = {});
  ~CameraEstimator();
  CameraEstimator(CameraEstimator&&) noexcept;
  CameraEstimator& operator=(CameraEstimator&&) noexcept;

  // The next image of a walk: 8-bit, one channel or BGR, all of one size; time stamps ascend.
  // Throws InputError.
  void Add(const cv::Mat& image, double timestamp);
  // Seconds between the first and the last image kept.
  double Duration() const;
  // Whether it keeps as many images as it ever uses at a time.
  bool IsFull() const;

  // From the images since the last Forget. Throws InputError without any.
  CameraEstimate Estimate();
  // Another part of the walk: what was found so far stays the start.
  void Forget();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// "focal length 953 +- 4 px (fov 67.7 x 41.0 degrees), k1 0.071, k2 -0.047, centre 635 366".
std::string Describe(const CameraEstimate& estimate);

}  // namespace oaslam
