#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common.h"
#include "detector_options.h"
#include "oaslam/io/detection_file.h"
#include "oaslam/io/image_source.h"
#include "oaslam/slam.h"

namespace oaslam::apps {

struct FrameInput {
  int index = 0;  // in the source
  std::string name;
  ImageInput input;
};

// Images with their time stamps and detections, from files or from a detector. Skips, with a warning, images that are missing or
// unreadable, and those whose time stamp is not after the one before.
class FrameInputs {
 public:
  struct Sources {
    std::string images, camera, detections;
    DetectorSettings detector;
  };

  FrameInputs(const Sources& sources, const CommonOptions& common);

  const Camera& camera() const { return camera_; }
  int size() const { return images_->size(); }
  const Detector* detector() const { return detector_.get(); }  // null: none
  std::optional<FrameInput> Next();

 private:
  std::optional<InputImage> NextReadable();

  std::unique_ptr<ImageSource> images_;
  std::optional<InputImage> ahead_;  // read for its size
  Camera camera_;
  DetectionTable detections_;
  std::unique_ptr<Detector> detector_;
  std::optional<double> last_timestamp_;
};

}  // namespace oaslam::apps
