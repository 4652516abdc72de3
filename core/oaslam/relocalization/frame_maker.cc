#include "oaslam/relocalization/frame_maker.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <utility>

#include "oaslam/camera_file.h"
#include "oaslam/error.h"
#include "oaslam/geometry/angular_velocity_check.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/detection_check.h"
#include "oaslam/objects/presence.h"
#include "oaslam/relocalization/depth_registration.h"
#include "oaslam/relocalization/given_input.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/check.h"

namespace oaslam {

namespace {

void CheckImageType(const cv::Mat& image) {
  const int type = image.type();
  if (type != CV_8UC1 && type != CV_8UC3 && type != CV_8UC4)
    throw InputError("image is neither 8-bit grey nor 8-bit BGR");
}

void CheckDetections(const std::vector<Detection>& detections) {
  for (size_t i = 0; i < detections.size(); ++i)
    if (const std::string problem = ProblemOf(detections[i]); !problem.empty())
      throw BadInput("detection {}: {}", i, problem);
}

}  // namespace

cv::Mat ToGrey(const cv::Mat& image) {
  CheckImageType(image);
  if (image.type() == CV_8UC1) return image;
  cv::Mat grey;
  cv::cvtColor(image, grey, image.type() == CV_8UC3 ? cv::COLOR_BGR2GRAY : cv::COLOR_BGRA2GRAY);
  return grey;
}

GreyImage ViewOf(const cv::Mat& grey) {
  OASLAM_CHECK(grey.type() == CV_8UC1);
  return {grey.data, static_cast<std::ptrdiff_t>(grey.step), grey.cols, grey.rows};
}

cv::Mat ImageOf(const ImageMask& mask, const cv::Size& size) {
  cv::Mat image(size, CV_8UC1);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      image.at<uint8_t>(y, x) =
          mask.Hides((x + 0.5) / size.width, (y + 0.5) / size.height) ? 0 : 255;
  return image;
}

void EraseHidden(const ImageMask& mask, const cv::Size& size, std::vector<Detection>& detections) {
  if (mask.HiddenShare() == 0) return;
  std::erase_if(detections, [&](const Detection& d) {
    constexpr int kSteps = 16;  // in each direction
    int hidden = 0;
    for (int i = 0; i < kSteps; ++i)
      for (int j = 0; j < kSteps; ++j)
        hidden += mask.Hides((d.box.x1 + (i + 0.5) / kSteps * d.box.Width()) / size.width,
                             (d.box.y1 + (j + 0.5) / kSteps * d.box.Height()) / size.height);
    return 2 * hidden > kSteps * kSteps;
  });
}

void CheckConfig(const SlamConfig& config) {
  const std::vector<std::string> problems = config.Validate();
  if (!problems.empty()) throw BadInput("configuration: {}", fmt::join(problems, "; "));
}

void CheckCamera(const Camera& camera) { CheckCalibration(camera, "camera"); }

void CheckMode(RelocalizationMode mode) {
  switch (mode) {
    case RelocalizationMode::kPoints:
    case RelocalizationMode::kObjects:
    case RelocalizationMode::kPointsAndObjects:
      return;
  }
  throw BadInput("relocalization mode {}: no such mode", static_cast<int>(mode));
}

void CheckPose(const std::optional<Rigid3>& pose) {
  constexpr double kRounding = 1e-6;  // the pose is used as it is given
  if (pose && !(pose->IsValid() && std::abs(pose->rotation.norm() - 1) < kRounding))
    throw InputError("pose: must be finite, and its rotation a unit quaternion");
}

void CheckGravity(const std::optional<Eigen::Vector3d>& gravity_in_cam) {
  if (gravity_in_cam && !(gravity_in_cam->allFinite() && gravity_in_cam->norm() > 0))
    throw InputError("gravity in the camera's frame: must be finite and not zero");
}

void CheckAngularVelocity(const std::vector<AngularVelocity>& samples, double image_s) {
  // Samples that come after one with a wrong time stamp in the future would all count as old.
  constexpr double kLatest = 1;  // s
  const double* last = nullptr;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (const std::string problem = ProblemOf(samples[i], last); !problem.empty())
      throw BadInput("sample {}: {}", i, problem);
    if (samples[i].timestamp > image_s + kLatest)
      throw BadInput(
          "sample {}: angular velocity: time stamp {:.6f}, allowed: at most {:.0f} s later than "
          "the image's, {:.6f}",
          i, samples[i].timestamp, kLatest, image_s);
    last = &samples[i].timestamp;
  }
}

void CheckImu(const ImageInput& input) {
  if (!input.imu.empty() && !input.angular_velocity.empty())
    throw InputError("imu and angular_velocity: give only one of them");
  std::vector<AngularVelocity> rates;
  for (size_t i = 0; i < input.imu.size(); ++i) {
    const ImuSample& sample = input.imu[i];
    rates.push_back({sample.timestamp, sample.angular_velocity});
    if (const std::string problem = ProblemOfAcceleration(sample.acceleration); !problem.empty())
      throw BadInput("sample {}: {}", i, problem);
  }
  CheckAngularVelocity(rates, input.timestamp);
}

std::vector<ObjectDetection> CheckedDetections(const Camera& camera,
                                               const std::vector<Detection>& detections) {
  CheckDetections(detections);
  return IdealDetections(camera, detections);
}

void FrameMaker::Check(const ImageInput& input) const {
  if (input.features && input.image.empty()) {
    CheckFeatures(*input.features);
  } else {
    if (input.image.cols != camera_->width || input.image.rows != camera_->height)
      throw BadInput("image of {}x{} pixels, the camera's calibration is for {}x{}",
                     input.image.cols, input.image.rows, camera_->width, camera_->height);
    CheckImageType(input.image);
  }
  if (input.motion) CheckMotion(*input.motion);
  CheckGravity(input.gravity_in_cam);
  CheckAngularVelocity(input.angular_velocity, input.timestamp);
  CheckImu(input);
  if (input.depth) CheckDepth(*input.depth, *camera_);
  CheckDetections(input.detections);
}

bool FrameMaker::UseFocalRatio(double ratio, double sigma) {
  constexpr double kStep = 0.0005;  // of the logarithm
  const int steps = static_cast<int>(std::lround(std::log(ratio) / kStep));
  if (std::exchange(focal_steps_, steps) == steps) return false;
  const double rounded = std::exp(kStep * steps);  // exactly 1 for no step
  Camera camera = Zoomed(given_, rounded);
  if (steps != 0) camera.focal_sigma = std::hypot(given_.focal_sigma, sigma);
  camera_ = std::make_shared<const Camera>(camera);
  extractor_.UseCamera(camera, rounded);
  nothing_ = std::make_shared<const Features>(extractor_.Nothing());
  return true;
}

Frame FrameMaker::MakeWithoutFeatures(const ImageInput& input, int index) const {
  Frame frame{index,
              input.timestamp,
              camera_,
              nothing_,
              IdealDetections(*camera_, input.detections),
              input.detections_follow,
              input.gravity_in_cam};
  frame.features_skipped = true;
  return frame;
}

Frame FrameMaker::Make(const ImageInput& input, int index, int keypoints,
                       const ClassRelations& classes) {
  Check(input);
  Frame frame = MakeWithoutFeatures(input, index);
  frame.features_skipped = false;
  const std::vector<Box> moving = MovingBoxes(frame, classes);
  if (input.image.empty()) {
    Features features = FeaturesOf(*input.features, nothing_->bounds);
    features.EraseKeypointsIn(moving);
    frame.features = std::make_shared<const Features>(std::move(features));
    return frame;
  }
  const cv::Mat grey = ToGrey(input.image);
  frame.features = std::make_shared<const Features>(ExtractStatic(ViewOf(grey), keypoints, moving));
  if (has_learned_)
    frame.image = std::make_shared<const GreyBuffer>(extractor_.WorkingImage(ViewOf(grey)));
  return frame;
}

std::vector<Box> FrameMaker::MovingBoxes(const Frame& frame, const ClassRelations& classes) const {
  std::vector<Box> boxes;
  for (const ObjectDetection& d : frame.detections)
    if (d.score >= min_score_ && classes.IsMovable(d.category_id)) boxes.push_back(d.box);
  return boxes;
}

// Extracts about `count` key points outside of `moving`, the boxes of objects that can move. A box
// does not tell the object from a static one in front of it, so that all key points inside are
// dropped.
Features FrameMaker::ExtractStatic(const GreyImage& grey, int count,
                                   const std::vector<Box>& moving) {
  if (moving.empty()) return extractor_.Extract(grey, count);
  const double share = 1 - HiddenShare(IdealImageBounds(*camera_), moving);
  Features features = extractor_.Extract(grey, static_cast<int>(count / std::max(share, 0.5)));
  features.EraseKeypointsIn(moving);
  return features;
}

}  // namespace oaslam
