#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "frame_inputs.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/viewer/viewer.h"

namespace oaslam::apps {

struct ViewerSettings {
  std::optional<int> port;  // --viewer [PORT]: nothing: no viewer
  ServerOptions server{};   // its port is not used
  bool stay = false, paused = false;
};

void AddViewerOptions(CLI::App& app, ViewerSettings& settings);

// Throws InputError where the page cannot be served, without serving it.
void CheckAddress(const ViewerSettings& settings);

// Brings a ground truth into the frame of a trajectory, for the viewer; to an empty one where they
// do not fit. Null for an empty one.
decltype(ViewerOptions::align_groundtruth) AlignerOf(const std::vector<StampedPose>& groundtruth);

// The run's interface to its viewer. Without a port all functions do nothing.
class LiveView {
 public:
  // `models`: virtual content that viewers may place.
  LiveView(const ViewerSettings& settings, const std::string& title, const Slam& slam,
           const std::vector<StampedPose>& groundtruth, std::shared_ptr<const ModelLibrary> models,
           bool quiet);

  // Carries out the commands of viewers since the last image; calls `reset` for a new map. Blocks
  // while the run is paused. Returns the seconds it was blocked.
  double Obey(Slam& slam, const std::function<void()>& reset);
  void Show(const Slam& slam, const FrameInput& frame, const TrackingResult& result, int dropped);
  // Shows the finished map; serves it until Ctrl-C if requested.
  void Finish(const SavedMap& saved, bool interrupted);

 private:
  void ShowStatus();
  void Tell(const Slam& slam, const std::string& anchor, const AnchorReport& report);
  void CarryOut(const ViewerCommand& command, Slam& slam, const std::function<void()>& reset);

  ViewerSettings settings_;
  std::unique_ptr<Viewer> viewer_;
  SceneStatus status_;
  std::optional<SceneStatus> shown_;
  int steps_ = 0, frame_ = 0;
};

}  // namespace oaslam::apps
