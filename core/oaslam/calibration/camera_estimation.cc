#include "oaslam/camera_estimation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "oaslam/bundle/self_calibration.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/images/focal_metadata.h"
#include "oaslam/odometry/still_parts.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/slam.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Images with more pixels are scaled down, which saves time and memory and keeps the focal length
// as accurate.
constexpr double kMaxPixels = 640 * 480;
// The number of images kept: 20 s of video, enough for one walk around a table.
constexpr size_t kMaxImages = 600;
constexpr double kMaxRateHz = 32;  // of images kept: all of a video of 30 Hz whose times vary
// Fields of view to begin with, degrees of the longer side: that of phones, then
// narrower and wider lenses.
constexpr double kUsualFov[] = {65, 50, 85, 105};
// Relative standard deviations of the focal length at which a first pass ends, and at which the
// final one ends. A lower bound takes more views and time, for a focal length that the map of the
// whole run corrects anyway.
constexpr double kRoughSigma = 0.01, kFineSigma = 0.005;
// Prior standard deviation of the readout time of a rolling shutter: phones take 10 to 30 ms, from
// the top or the bottom row.
constexpr double kReadoutSigmaS = 0.02;

Camera WithFocalLength(const cv::Size& size, double focal) {
  Camera camera{.width = size.width, .height = size.height, .fx = focal, .fy = focal};
  camera.cx = 0.5 * (size.width - 1);
  camera.cy = 0.5 * (size.height - 1);
  camera.is_guess = true;
  camera.name = "estimated";
  return camera;
}

double FocalLengthOf(const cv::Size& size, double fov_deg) {
  return 0.5 * std::max(size.width, size.height) / std::tan(0.5 * fov_deg * std::numbers::pi / 180);
}

struct Pass {
  SelfCalibration calibration;
  int images = 0;
};

double Change(const Camera& a, const Camera& b) { return std::abs(std::log(a.fx / b.fx)); }

}  // namespace

class OASLAM_LOCAL CameraEstimator::Impl {
 public:
  Impl(const SlamConfig& config, const CameraEstimationOptions& options)
      : config_(config), options_(options) {
    if (config_.runner.mode == RunnerMode::kLive) config_.runner.mode = RunnerMode::kLockstep;
  }

  void Add(const cv::Mat& image, double timestamp) {
    if (image.empty()) throw InputError("camera estimation: empty image");
    if (original_.empty()) SetSize(image.size());
    if (image.size() != original_)
      throw BadInput("camera estimation: image of {}x{} pixels among {}x{}", image.cols, image.rows,
                     original_.width, original_.height);
    if (!times_.empty() && !(timestamp > times_.back()))
      throw BadInput("time stamp {:.6f} is not after the one before, {:.6f}", timestamp,
                     times_.back());
    if (IsFull() || (!times_.empty() && timestamp - times_.back() < 1 / kMaxRateHz)) return;
    cv::Mat small = ToGrey(image);
    if (size_ != original_) cv::resize(small, small, size_, 0, 0, cv::INTER_AREA);
    images_.push_back(small.data == image.data ? small.clone() : small);
    times_.push_back(timestamp);
  }

  double Duration() const { return times_.empty() ? 0 : times_.back() - times_.front(); }
  bool IsFull() const { return images_.size() >= kMaxImages; }

  void Forget() {
    images_.clear();
    times_.clear();
  }

  CameraEstimate Estimate() {
    if (images_.empty()) throw InputError("camera estimation: no images");
    best_.reset();
    mask_ = Mask();
    int undetermined = 0;
    for (const Camera& start : Starts()) {
      const Pass pass = Map(start, kRoughSigma);
      Keep(pass);
      if (pass.calibration.success && CalibrateUntilStable(pass)) break;
      // Where a map of many views does not determine the camera, a map from another guess does not,
      // either.
      constexpr int kManyKeyframes = 20, kEnoughMaps = 2;  // chosen so, not measured
      undetermined += pass.calibration.keyframes >= kManyKeyframes;
      if (undetermined >= kEnoughMaps) break;
    }
    return Answer();
  }

 private:
  void SetSize(const cv::Size& size) {
    original_ = size_ = size;
    const double scale = std::sqrt(kMaxPixels / (static_cast<double>(size.width) * size.height));
    if (scale >= 1) return;
    size_ = {std::max(1, static_cast<int>(std::lround(scale * size.width))),
             std::max(1, static_cast<int>(std::lround(scale * size.height)))};
  }

  // The expected lens; its focal length is still a guess.
  Camera Expected() const {
    return options_.start ? Scaled(*options_.start, size_.width, size_.height)
                          : Guess(FocalLengthOf(original_, kUsualFov[0]));
  }

  // Of the images that are kept. It is found once, not in each pass; one that hides nothing if
  // there is no such part.
  cv::Mat Mask() const {
    cv::Mat mask;
    if (!options_.mask.empty()) {
      cv::resize(options_.mask, mask, size_, 0, 0, cv::INTER_NEAREST);
      return mask;
    }
    StillParts parts;
    for (size_t i = 0; i < images_.size(); ++i) parts.Add(ViewOf(images_[i]), times_[i]);
    return ImageOf(parts.mask(), size_);
  }

  // Pixels are square in the original images.
  Camera Guess(double focal) const {
    return Scaled(WithFocalLength(original_, focal), size_.width, size_.height);
  }

  std::vector<Camera> Starts() const {
    std::vector<Camera> starts;
    if (found_) starts.push_back(*found_);
    if (options_.start) starts.push_back(Expected());
    if (options_.focal_length_35mm)
      starts.push_back(Guess(*options_.focal_length_35mm / kFrameDiagonal35mm *
                             std::hypot(original_.width, original_.height)));
    for (const double fov : kUsualFov) starts.push_back(Guess(FocalLengthOf(original_, fov)));
    return starts;
  }

  // Maps the images until the relative standard deviation of the focal length is below `enough`, or
  // to the last image.
  Pass Map(const Camera& camera, double enough) const {
    // Keyframes before the first attempt, since few hardly determine a camera; not measured.
    constexpr size_t kFirstCheck = 8;
    // After this factor of keyframes the calibration is tried again, so that its time is a constant
    // share.
    constexpr double kNextCheck = 1.35;
    Slam slam(config_, camera);
    slam.SetMask(mask_);
    const SelfCalibrationOptions quickly{
        .expected = Expected(), .readout_sigma_s = kReadoutSigmaS, .compares_parts = false};
    Pass pass;
    pass.calibration.camera = camera;
    pass.calibration.why_not = "the images could not be mapped";
    size_t next_check = kFirstCheck, checked = 0;
    const auto check = [&] {
      const SavedMap saved = SavedMapOf(slam.WholeMap());
      if (saved.map.keyframes.empty() || saved.map.keyframes.size() == checked) return;
      checked = saved.map.keyframes.size();
      pass.calibration = SelfCalibrate(saved.map, 0, quickly, saved.trajectory);
    };
    for (size_t i = 0; i < images_.size(); ++i) {
      slam.Process({images_[i], times_[i], {}, false});
      ++pass.images;
      const size_t keyframes = slam.Snapshot().Keyframes().size();
      if (keyframes < kFirstCheck) next_check = kFirstCheck;  // the map was begun anew
      if (keyframes < next_check) continue;
      next_check = static_cast<size_t>(std::ceil(kNextCheck * static_cast<double>(keyframes)));
      check();
      if (pass.calibration.success && pass.calibration.RelativeSigma() < enough) break;
    }
    if (!(pass.calibration.success && pass.calibration.RelativeSigma() < enough)) check();
    Log(LogLevel::kDebug,
        "camera estimation: {} images from a focal length of {:.1f}: {:.1f} +- {:.1f}, "
        "k1 {:.4f}, k2 {:.4f}, centre {:.1f} {:.1f}, readout {:.1f} +- {:.1f} ms, "
        "{} keyframes, {} of {} observations, rmse {:.3f}{}{}",
        pass.images, camera.fx, pass.calibration.camera.fx, pass.calibration.focal_sigma_px,
        pass.calibration.camera.distortion[0], pass.calibration.camera.distortion[1],
        pass.calibration.camera.cx, pass.calibration.camera.cy, 1000 * pass.calibration.readout_s,
        1000 * pass.calibration.readout_sigma_s, pass.calibration.keyframes,
        pass.calibration.inliers, pass.calibration.observations, pass.calibration.rmse,
        pass.calibration.success ? "" : ": ", pass.calibration.why_not);
    return pass;
  }

  // Maps the images again with the camera found, until it no longer changes. Returns false where
  // such a map does not determine the camera.
  bool CalibrateUntilStable(const Pass& rough) {
    constexpr int kRounds = 4;       // bounds the time
    constexpr double kStays = 0.01;  // relative; the final map of all images corrects what is left
    Pass before = rough;
    for (int round = 0; round < kRounds; ++round) {
      Camera found = before.calibration.camera;
      found.is_guess = false;  // so that a change of the lens is noticed
      found.focal_sigma = before.calibration.RelativeSigma();
      Pass pass = Map(found, kFineSigma);
      if (!pass.calibration.success) return false;
      const double change = Change(pass.calibration.camera, before.calibration.camera);
      const bool stays = change < std::max(kStays, pass.calibration.RelativeSigma());
      // The change between two maps is a lower bound on the standard deviation.
      pass.calibration.focal_sigma_px =
          std::max(pass.calibration.focal_sigma_px, change * pass.calibration.camera.fx);
      best_ = before = pass;
      if (stays) return true;
    }
    SelfCalibration& last = best_->calibration;
    last.success = false;
    last.why_not = fmt::format("the focal length still changed by {:.1f} % in the last of {} maps",
                               100 * last.RelativeSigma(), kRounds);
    return false;
  }

  void Keep(const Pass& pass) {
    const bool is_better = !best_ || (pass.calibration.success && !best_->calibration.success) ||
                           (pass.calibration.success == best_->calibration.success &&
                            pass.calibration.RelativeSigma() < best_->calibration.RelativeSigma());
    if (is_better) best_ = pass;
  }

  CameraEstimate Answer() {
    // Relative sigma; a guess of the field of view is off by more.
    constexpr double kWorthMoreThanAGuess = 0.1;
    // Of a guess: phones, cameras of drones and wide lenses have fields of view of 50 to 85
    // degrees.
    constexpr double kOfAGuess = 0.2;
    const SelfCalibration& found = best_->calibration;
    CameraEstimate estimate;
    estimate.is_determined = found.success;
    estimate.why_not = found.why_not;
    estimate.images = best_->images;
    estimate.rmse = found.rmse;
    const bool is_usable = found.success || found.RelativeSigma() < kWorthMoreThanAGuess;
    const Camera camera = is_usable ? found.camera : Starts().front();
    if (is_usable) {
      found_ = camera;
      estimate.focal_sigma_px = found.focal_sigma_px * original_.width / size_.width;
      estimate.readout_s = found.SureReadout();
    }
    estimate.camera = Scaled(camera, original_.width, original_.height);
    estimate.camera.is_guess = !found.success;
    estimate.camera.focal_sigma = found.success ? 0 : is_usable ? found.RelativeSigma() : kOfAGuess;
    estimate.camera.name =
        options_.start && !options_.start->name.empty() ? options_.start->name : "estimated";
    return estimate;
  }

  SlamConfig config_;
  CameraEstimationOptions options_;
  cv::Size original_, size_;
  std::vector<cv::Mat> images_;
  cv::Mat mask_;
  std::vector<double> times_;
  std::optional<Pass> best_;     // from the present images
  std::optional<Camera> found_;  // from earlier images
};

CameraEstimator::CameraEstimator(const SlamConfig& config, const CameraEstimationOptions& options) {
  CheckConfig(config);
  if (options.start) CheckCamera(*options.start);
  if (options.focal_length_35mm && !CanBeFocalLength35mm(*options.focal_length_35mm))
    throw BadInput("focal length of 35 mm equivalent: {}, allowed: 2 to 3000 mm",
                   *options.focal_length_35mm);
  impl_ = std::make_unique<Impl>(config, options);
}
CameraEstimator::~CameraEstimator() = default;
CameraEstimator::CameraEstimator(CameraEstimator&&) noexcept = default;
CameraEstimator& CameraEstimator::operator=(CameraEstimator&&) noexcept = default;
void CameraEstimator::Add(const cv::Mat& image, double timestamp) { impl_->Add(image, timestamp); }
double CameraEstimator::Duration() const { return impl_->Duration(); }
bool CameraEstimator::IsFull() const { return impl_->IsFull(); }
CameraEstimate CameraEstimator::Estimate() { return impl_->Estimate(); }
void CameraEstimator::Forget() { impl_->Forget(); }

std::string Describe(const CameraEstimate& estimate) {
  const Camera& c = estimate.camera;
  const auto fov = [](int side, double focal) {
    return 2 * std::atan(0.5 * side / focal) * 180 / std::numbers::pi;
  };
  const std::string sigma = std::isfinite(estimate.focal_sigma_px)
                                ? fmt::format(" +- {:.2g}", estimate.focal_sigma_px)
                                : std::string();
  const std::string readout = estimate.readout_s != 0 ? fmt::format(", rolling shutter {:.1f} ms",
                                                                    1000 * estimate.readout_s)
                                                      : std::string();
  return fmt::format(
      "focal length {:.1f}{} px (fov {:.1f} x {:.1f} degrees), k1 {:.4f}, k2 {:.4f}, centre {:.1f} "
      "{:.1f}{}",
      c.fx, sigma, fov(c.width, c.fx), fov(c.height, c.fy), c.distortion[0], c.distortion[1], c.cx,
      c.cy, readout);
}

}  // namespace oaslam
