#pragma once

#include <limits>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/export.h"

namespace oaslam {

// What is known of the camera beforehand.
struct CameraEstimationOptions {
  // The camera to start from: a rough calibration, or that of another run.
  std::optional<Camera> start{};
  // The 35 mm equivalent that cameras and phones write into an image's metadata, 2 to 3000 mm
  // (FocalLength35mm reads it). Only a start value.
  std::optional<double> focal_length_35mm{};
  // A mask of the parts that move with the camera (Slam::SetMask), of the images' size. Where it is
  // empty, the estimator finds these parts itself.
  cv::Mat mask{};
};

// The result of estimating a camera from its images.
struct CameraEstimate {
  Camera camera;  // the best estimate, or a guess
  // Whether the images determine the camera; if not, `why_not` tells why.
  bool is_determined = false;
  // 1 sigma; infinite for a guess.
  double focal_sigma_px = std::numeric_limits<double>::infinity();
  std::string why_not;
  // The time in which the camera reads out an image from its top row to its bottom row (below 0:
  // upwards); 0: all rows at once, or unknown.
  double readout_s = 0;
  int images = 0;   // number of images used
  double rmse = 0;  // of the reprojections, in units of the key points' scale
};

// Estimates the camera of images without calibration: maps parts of them with a guess of the focal
// length, calibrates the camera by that map, and repeats this with the result until it no longer
// changes. The same images give the same answer. It keeps the images, large ones scaled down:
//
//   CameraEstimator estimator(SlamConfig::Offline());
//   while (const auto image = source->Next()) estimator.Add(image->image, image->timestamp);
//   const CameraEstimate estimate = estimator.Estimate();
//   if (estimate.is_determined) Slam slam(SlamConfig::Live(), estimate.camera);
class OASLAM_API CameraEstimator {
 public:
  // `config`: the settings of the maps that it makes. Throws InputError for settings and start
  // values out of their bounds.
  explicit CameraEstimator(const SlamConfig& config, const CameraEstimationOptions& options = {});
  ~CameraEstimator();
  CameraEstimator(CameraEstimator&&) noexcept;
  CameraEstimator& operator=(CameraEstimator&&) noexcept;

  // Adds the next image: 8-bit, one channel or BGR, all of one size; time stamps
  // ascend. Throws InputError.
  void Add(const cv::Mat& image, double timestamp);
  // Seconds between the first and the last image kept.
  double Duration() const;
  // Whether it holds as many images as Estimate uses.
  bool IsFull() const;

  // Estimates the camera from the images since the last Forget, on the caller's thread and others:
  // it maps the images several times, which takes longer than one run of Slam over them. Throws
  // InputError without any.
  CameraEstimate Estimate();
  // Drops the images, to continue with another part of the recording; the last result becomes the
  // start value.
  void Forget();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

// Describes an estimate in words: "focal length 953 +- 4 px (fov 67.7 x 41.0 degrees), k1 0.071, k2
// -0.047, centre 635 366".
OASLAM_API std::string Describe(const CameraEstimate& estimate);

}  // namespace oaslam
