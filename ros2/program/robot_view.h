#pragma once

#include <memory>
#include <optional>

#include "live_view.h"
#include "oaslam/ros2/robot_node.h"

namespace oaslam::apps {

// Takes the images of a run from ROS 2, and publishes there what is found; shows the run in a
// browser, too, where --viewer asks for it.
class RobotView : public LiveView {
 public:
  explicit RobotView(const RosArguments& names) { options_.names = names; }

  // What the images of the node are called as a source.
  static constexpr char kScheme[] = "ros2:";
  std::unique_ptr<ImageSource> OpenImages(const ImageSourceOptions& options) {
    return node_->OpenImages(options);
  }

  void AddOptions(CLI::App& run) override;
  void Check() override;
  std::optional<Camera> CameraOfSource(const std::string& images) override;
  void Prepare(Slam& slam, FrameInput& frame) override;
  void Show(const Slam& slam, const FrameInput& frame, const TrackingResult& result,
            int dropped) override;
  void ShowLate(int frame, const std::vector<Detection>& detections) override;
  void Finish(const SavedMap& saved, bool interrupted) override;

 private:
  void SetUp(Slam& slam);

  RobotOptions options_;
  std::optional<uint32_t> domain_;
  bool is_read_only_ = false, is_set_up_ = false, has_acceleration_ = false;
  Rigid3 cam_from_imu_;
  ClassNames names_;
  std::unique_ptr<RobotNode> node_;
};

}  // namespace oaslam::apps
