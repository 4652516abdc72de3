#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frame_inputs.h"
#include "oaslam/formats/trajectory_file.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/viewer/viewer.h"

namespace oaslam::apps {

constexpr int kViewerPort = 8340;

struct ViewerSettings {
  std::optional<int> port;  // --viewer [PORT]: nothing where no viewer is wanted
  std::string bind = "127.0.0.1";
  bool stay = false, paused = false;
};

void AddViewerOptions(CLI::App& app, ViewerSettings& settings);

// Ground truth in the frame of a trajectory, for the viewer; empty where they do not fit.
std::vector<StampedPose> AlignGroundtruth(const std::vector<StampedPose>& groundtruth,
                                          const std::vector<StampedPose>& trajectory);

// A run's side of its viewer. Without a port none of its functions does anything.
class LiveView {
 public:
  // `models`: virtual content that viewers may place.
  LiveView(const ViewerSettings& settings, const std::string& title, const Slam& slam,
           const std::vector<StampedPose>& groundtruth, std::shared_ptr<const ModelLibrary> models,
           bool quiet);

  bool IsOpen() const { return viewer_ != nullptr; }
  // Carries out what viewers asked for since the last image, `reset` where they want a new map;
  // waits while they hold the run. Returns the seconds it waited.
  double Obey(Slam& slam, const std::function<void()>& reset);
  void Show(const Slam& slam, const FrameInput& frame, const TrackingResult& result, int dropped);
  // The finished map; serves on until Ctrl-C where that was asked for.
  void Finish(const SavedMap& saved, bool interrupted);

 private:
  void ShowStatus();
  void Tell(const Slam& slam, const std::string& anchor, const std::string& problem);
  void CarryOut(const ViewerCommand& command, Slam& slam, const std::function<void()>& reset);

  ViewerSettings settings_;
  std::unique_ptr<Viewer> viewer_;
  SceneStatus status_;
  std::optional<SceneStatus> shown_;
  int steps_ = 0, frame_ = 0;
};

}  // namespace oaslam::apps
