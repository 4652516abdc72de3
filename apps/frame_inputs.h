#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common.h"
#include "detector_options.h"
#include "gravity_file.h"
#include "oaslam/detection/background_detector.h"
#include "oaslam/formats/detection_file.h"
#include "oaslam/images/image_source.h"
#include "oaslam/images/latest_image.h"
#include "oaslam/slam.h"

namespace oaslam::apps {

struct FrameInput {
  int index = 0;  // in the source
  std::string name;
  ImageInput input;
  std::string path;                                // of the image's own file, if it has one
  Orientation orientation = Orientation::kStored;  // as which that file is read
};

// How fast a detector was.
struct DetectorPace {
  int images = 0;
  double busy_ms = 0;
};

// Images with their time stamps and detections, from files or from a detector. Skips, with a
// warning, images that are missing or unreadable, and those whose time stamp is not after the one
// before.
class FrameInputs {
 public:
  struct Sources {
    std::string images, camera,
        detections;  // camera: as LoadCamera; "auto" or nothing: any, of the images' size
    DetectorSettings detector;
    bool live = false;  // a camera or a growing folder gives its newest image, and nobody waits for
                        // a detector
    bool for_display = false;              // in colour where that costs nothing
    std::string gravity;                   // file; empty: none
    std::optional<Camera> known_camera{};  // takes the place of `camera`
  };

  FrameInputs(const Sources& sources, const CommonOptions& common);

  const Camera& camera() const { return camera_; }
  int size() const { return images_->size(); }
  const Detector* detector() const { return detector_.get(); }  // null: none
  // The source has a pace of its own: images come when they are taken.
  bool is_live() const { return latest_ != nullptr; }
  // Images of a live source that came and went while another was worked on.
  int dropped() const { return latest_ ? latest_->dropped() : 0; }
  std::optional<FrameInput> Next();

  // Live, with a detector: takes the image of a processed frame, whose detections TakeLate gives
  // once they are there.
  void DetectLate(int frame, const cv::Mat& image) {
    if (background_) background_->Offer(frame, image);
  }
  std::vector<BackgroundDetector::Result> TakeLate() {
    return background_ ? background_->Take() : std::vector<BackgroundDetector::Result>{};
  }
  // Waits for the detections under way.
  void FinishLate() {
    if (background_) background_->Wait();
  }
  // Once all images are read: says it where no gravity sample was near any.
  void CheckGravity() const { gravity_.WarnIfUnused(); }
  DetectorPace pace() const {
    return background_ ? DetectorPace{background_->images(), background_->busy_ms()} : pace_;
  }

 private:
  std::optional<InputImage> NextReadable();

  std::unique_ptr<ImageSource> images_;
  const LatestImageSource* latest_ = nullptr;  // images_, where it is live
  std::optional<InputImage> ahead_;            // read for its size
  Camera camera_;
  DetectionTable detections_;
  GravityTrack gravity_;
  std::unique_ptr<Detector> detector_;
  std::optional<double> last_timestamp_;
  DetectorPace pace_;  // of detections that were waited for
  std::unique_ptr<BackgroundDetector>
      background_;  // of those that were not; ends before the detector
};

}  // namespace oaslam::apps
