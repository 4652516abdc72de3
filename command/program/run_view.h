#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "frame_inputs.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::apps {

// What shows a run of SLAM while it goes on, and may bring its camera. This one does neither: it is
// that of `oaslam`. oaslam-viewer has one that serves a page (viewer/program/live_view.h),
// oaslam-ros2 one with the topics of a robot (ros2/program/robot_view.h). The functions are called
// in the order in which they stand here.
class RunView {
 public:
  virtual ~RunView() = default;

  // Adds its options to `oaslam run`; here those that say where they are.
  virtual void AddOptions(CLI::App& run);
  virtual bool IsAskedFor() const { return false; }
  // The number that --viewer means, which once was the option of the port.
  virtual int PortIfLeftOut() const { return 0; }
  // Throws InputError where it could not show a run, as where its port is taken.
  virtual void Check() {}
  // The calibration that the source of the images tells, where no other is given; may wait for it.
  virtual std::optional<Camera> CameraOfSource(const std::string& /*images*/) {
    return std::nullopt;
  }
  virtual void Begin(const std::string& /*title*/, const Slam& /*slam*/,
                     const std::vector<StampedPose>& /*groundtruth*/, bool /*quiet*/) {}

  // For each image: carries out what viewers asked since the last one; calls `reset` for a new map.
  // Blocks while the run is paused. Returns the seconds it was blocked.
  virtual double Obey(Slam& /*slam*/, const std::function<void()>& /*reset*/) { return 0; }
  // Before each image is processed: adds to it what the source measured since the one before.
  virtual void Prepare(Slam& /*slam*/, FrameInput& /*frame*/) {}
  virtual void Show(const Slam& /*slam*/, const FrameInput& /*frame*/,
                    const TrackingResult& /*result*/, int /*dropped*/) {}
  // Shows what a detector found that works beside the run. `frame`: TrackingResult::frame.
  virtual void ShowLate(int /*frame*/, const std::vector<Detection>& /*detections*/) {}

  // Shows the finished map, until Ctrl-C where that was asked.
  virtual void Finish(const SavedMap& /*saved*/, bool /*interrupted*/) {}
};

}  // namespace oaslam::apps
