#pragma once

#include <algorithm>
#include <atomic>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common.h"
#include "detector_options.h"
#include "gravity_file.h"
#include "oaslam/background_detector.h"
#include "oaslam/detection/detector_pool.h"
#include "oaslam/detection/turned_detector.h"
#include "oaslam/detection/view_change.h"
#include "oaslam/detection_file.h"
#include "oaslam/formats/detection_input.h"
#include "oaslam/formats/imu_file.h"
#include "oaslam/image_source.h"
#include "oaslam/images/depth_files.h"
#include "oaslam/latest_image.h"
#include "oaslam/odometry/gyroscope.h"
#include "oaslam/slam.h"
#include "readable_images.h"

namespace oaslam::apps {

struct FrameInput {
  int index = 0;  // in the source
  std::string name;
  ImageInput input;
  std::string path;                                // of the image's own file, if it has one
  Orientation orientation = Orientation::kStored;  // the orientation in which that file is read
  std::optional<double> taken_s{};                 // as in InputImage
};

struct DetectorPace {
  int images = 0;
  double busy_ms = 0;
};

// Paths of files besides images; empty: none.
struct SideFiles {
  std::string detections, gravity, imu, depth;
  // What is known of the recorder of `imu`, as in Dataset.
  double imu_begin_s = 0;
  std::optional<Rigid3> cam_from_imu{};
  bool imu_may_fail = false;           // nobody asked for it: it is left out, with a warning
  std::optional<double> depth_unit{};  // metres
  std::string depth_camera{};          // the calibration of a depth camera that is not registered
  std::optional<DepthFiles> depth_of_dataset{};
  // Of a recording of ROS: used where no file is given.
  std::optional<Camera> recorded_camera{};
  std::optional<ImuRecording> recorded_imu{};
  std::string imu_place{};      // for messages
  std::string recorded_axes{};  // how its axes were found, in words
  std::optional<DetectionFile> recorded_detections{};

  // Where the dataset's depths are put, unless others are asked for.
  std::optional<DepthFiles>* DepthOfDataset() {
    return depth.empty() ? &depth_of_dataset : nullptr;
  }
};

CLI::Option* AddImuOption(CLI::App& app, SideFiles& files);
CLI::Option* AddDepthOptions(CLI::App& app, SideFiles& files);

// The inputs of a command besides images. They are read before the first image, so that errors in
// them are reported at once.
struct SideInputs {
  // Throws InputError. Empty paths: nothing. `camera` tells how it lies to the gyroscope, if it is
  // a file.
  SideInputs(const SideFiles& files, const std::string& camera,
             const DetectorSettings& detector_settings, const CommonOptions& common);

  DetectionTable detections;
  bool in_shares = false;  // its boxes are shares of the image's sides
  std::string detections_path;
  ClassNames categories;  // of the detections, if these have classes of their own
  GravityTrack gravity;
  ImuRecording imu;
  std::optional<DepthFiles> depth;
  std::optional<Camera> recorded_camera;  // where no other is given
  Rigid3 cam_from_imu;
  std::string axes;                    // of the IMU, in words
  std::unique_ptr<Detector> detector;  // null: none
};

// Gravity in the camera's frame, and whether it follows from measurements, or only from how the
// camera was held.
struct Vertical {
  Eigen::Vector3d gravity_in_cam;
  bool is_measured = false;
};

// The vertical in the image of a frame, as it was measured, or as the map knows it.
std::optional<Vertical> VerticalIn(const Slam& slam, const FrameInput& frame,
                                   const TrackingResult& result);

// Images with their time stamps and detections, from files or from a detector. Skips what
// ReadableImages skips. A detector works ahead on threads of its own; which images it looks at, and
// what it finds, does not depend on its speed.
class FrameInputs {
 public:
  struct Sources {
    // `camera`: as for LoadCamera; "auto" or empty: any camera of the images' size, or that of a
    // recording of ROS.
    std::string images, camera;
    DetectorSettings detector;
    // A camera or a growing folder gives its newest image, and the detector
    // works in the background.
    bool live = false;
    bool for_display = false;  // in colour where the source decodes to colour anyway
    // The camera begins in a given map, lost until it is found.
    bool in_map = false;
    std::optional<Camera> known_camera{};  // used instead of `camera`
    bool any_size = false;                 // images may differ in size from the camera
  };

  FrameInputs(const Sources& sources, SideInputs side, const CommonOptions& common);

  const Camera& camera() const { return camera_; }
  int size() const { return images_->count(); }
  bool has_depths() const { return depths_.has_value(); }
  // How the IMU lies to the camera.
  const Rigid3& cam_from_imu() const { return side_.cam_from_imu; }
  // Whether the source is live: images come when they are taken.
  bool is_live() const { return latest_ != nullptr; }
  // The number of images of a live source that were missed while another was processed.
  int dropped() const { return latest_ ? latest_->dropped() : 0; }
  // The next image; nothing at the end, and once the command is interrupted. The detector looks at
  // images whose view has changed; of a lost camera as HelpsLostCamera says.
  std::optional<FrameInput> Next();
  // The last image is not processed: its samples of angular velocity come with the next one.
  void KeepSamples(const FrameInput& frame) {
    given_samples_ -= std::max(frame.input.angular_velocity.size(), frame.input.imu.size());
  }
  // The state after the last image. The camera counts as lost unless points gave its pose.
  void SetState(TrackingState state);

  // Live, with a detector: offers the image of a processed frame; TakeLate returns its detections
  // once they are ready.
  // `vertical`: in this image.
  void DetectLate(int frame, const cv::Mat& image, const std::optional<Vertical>& vertical);
  // Not live: what is known of the vertical in the image of the last frame tells how later images
  // are turned for the detector.
  void SetVertical(const std::optional<Vertical>& vertical);
  std::vector<BackgroundDetector::Result> TakeLate();
  // Waits for detections in progress.
  void FinishLate() {
    if (background_) background_->Wait();
  }
  // Call it once all images are read. Warns where no sample of a sensor was near any image, and
  // says what is known of the gyroscope (--imu), which was given its samples.
  void ReportSensors(const ImuCalibration& known) const;
  DetectorPace pace() const {
    if (background_) return {background_->images(), background_->busy_ms()};
    if (!pool_) return {};
    // Detections that were made ahead may not have been needed, where the camera got lost.
    const double ms = pool_->busy_ms() / std::max(pool_->images(), 1);
    return {looked_at_, looked_at_ * ms};
  }

 private:
  // An image that was read, perhaps ahead of its turn.
  struct ReadImage {
    InputImage image;
    bool is_chosen = false;                       // for the detector
    int turn = 0;                                 // that brings it upright
    std::future<std::vector<Detection>> found{};  // valid once the detector has the image
  };

  std::optional<InputImage> NextReadable();
  void StartDetector(const Sources& sources, const ImageSourceOptions& range);
  // Reads images, those within `ahead` of the next one.
  void Read(size_t ahead);
  // Whether the detector looks at an image that was chosen. `last`: the one that it looked at last.
  bool IsWanted(const InputImage& image, const InputImage& last) const;
  bool Choose(const InputImage& image);
  int TurnFor(const InputImage& image);

  std::unique_ptr<ReadableImages> images_;
  const LatestImageSource* latest_ = nullptr;  // in images_ if the source is live
  std::deque<ReadImage>
      read_;               // read ahead; the first image is read in the constructor, for its size
  size_t most_ahead_ = 0;  // images
  int read_count_ = 0, looked_at_ = 0;
  Camera camera_;
  SideInputs side_;
  std::optional<double> lost_since_s_;  // while the camera is lost
  double given_s_ = 0;                  // time stamp of the image that was given last
  InputImage last_looked_at_;           // by the detector
  std::optional<DepthSource> depths_;
  std::optional<double> first_timestamp_, last_timestamp_;
  size_t given_samples_ = 0;       // of angular velocity
  std::optional<int> given_turn_;  // --detector-turn
  // Of images whose vertical is not known: by the map where its vertical was measured, else by
  // the boxes.
  std::optional<int> turn_by_map_;
  std::optional<TurnedDetector> turn_by_boxes_;
  // The turn by how the camera was held, for the detector in the background; negative: unknown.
  std::atomic<int> held_turn_ = -1;
  std::map<int, std::pair<int, cv::Size>> late_turns_;  // of images in the background, with sizes
  int detect_every_ = 0;                                // 0: where the view changes
  ViewChange view_change_;
  // The detector in the background (live), or its copies (else); destroyed before `side_`.
  std::unique_ptr<BackgroundDetector> background_;
  std::unique_ptr<DetectorPool> pool_;
};

}  // namespace oaslam::apps
