#include "frame_inputs.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <opencv2/core/utility.hpp>

#include "camera_choice.h"
#include "oaslam/formats/camera_file.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam::apps {

FrameInputs::FrameInputs(const Sources& sources, const CommonOptions& common) {
  if (!sources.detections.empty()) detections_ = LoadDetections(sources.detections);
  if (!sources.gravity.empty()) gravity_ = GravityTrack::Load(sources.gravity);
  detector_ = LoadDetector(sources.detector);
  // Only a network profits from OpenCV's threads: for the small images of a pyramid the threads
  // cost more than they gain.
  if (!detector_) cv::setNumThreads(1);
  ImageSourceOptions range = FrameRange(common);
  range.color = detector_ != nullptr;
  range.color_if_free = sources.for_display;
  images_ = OpenImages(sources.images, range);
  if (sources.live && (range.follow || sources.images.starts_with("webcam:"))) {
    auto latest = std::make_unique<LatestImageSource>(std::move(images_));
    latest_ = latest.get();
    images_ = std::move(latest);
  }
  ahead_ = NextReadable();
  if (!ahead_) throw InputError(fmt::format("{}: no readable image", sources.images));
  const bool is_auto = IsAutoCamera(sources.camera);
  camera_ = sources.known_camera
                ? *sources.known_camera
                : LoadCamera(is_auto ? "fov:65" : sources.camera, ahead_->image.size());
  if (sources.live && detector_)
    background_ = std::make_unique<BackgroundDetector>(
        [this](const cv::Mat& image) { return detector_->Detect(image); });
  if (camera_.is_guess && !sources.known_camera && !is_auto)
    spdlog::warn("{}: a guess, not a calibration; expect a bent map", sources.camera);
}

std::optional<InputImage> FrameInputs::NextReadable() {
  while (std::optional<InputImage> image = images_->Next()) {
    if (image->image.empty()) {
      spdlog::warn("image {} ({}): missing or unreadable, skipped", image->index, image->name);
      continue;
    }
    if (last_timestamp_ && !(image->timestamp > *last_timestamp_)) {
      spdlog::warn("image {} ({}): time stamp {:.6f} is not after {:.6f}, skipped", image->index,
                   image->name, image->timestamp, *last_timestamp_);
      continue;
    }
    last_timestamp_ = image->timestamp;
    return image;
  }
  return std::nullopt;
}

std::optional<FrameInput> FrameInputs::Next() {
  std::optional<InputImage> image = ahead_ ? std::exchange(ahead_, std::nullopt) : NextReadable();
  if (!image) return std::nullopt;
  FrameInput frame{image->index,
                   image->name,
                   {image->image, image->timestamp, {}, false, gravity_.At(image->timestamp)},
                   image->path,
                   image->orientation};
  if (background_) {
    frame.input.detections_follow = true;
  } else if (detector_) {
    const Stopwatch watch;
    frame.input.detections = detector_->Detect(image->image);
    pace_.busy_ms += watch.WallMs();
    ++pace_.images;
  } else {
    frame.input.detections = detections_.Find(image->name);
  }
  return frame;
}

}  // namespace oaslam::apps
