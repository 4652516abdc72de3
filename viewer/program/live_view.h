#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/viewer/viewer.h"
#include "run_view.h"

namespace oaslam::apps {

// Brings a ground truth into the frame of a trajectory, for the viewer; to an empty one where they
// do not fit. Null for an empty one.
decltype(ViewerOptions::align_groundtruth) AlignerOf(const std::vector<StampedPose>& groundtruth);

// Serves a page that shows a run, where --viewer asks for it, and carries out the commands of those
// who see it.
class LiveView : public RunView {
 public:
  void AddOptions(CLI::App& run) override;
  bool IsAskedFor() const override { return port_.has_value(); }
  int PortIfLeftOut() const override;
  void Check() override;
  void Begin(const std::string& title, const Slam& slam,
             const std::vector<StampedPose>& groundtruth, bool quiet) override;
  double Obey(Slam& slam, const std::function<void()>& reset) override;
  void Show(const Slam& slam, const FrameInput& frame, const TrackingResult& result,
            int dropped) override;
  void Finish(const SavedMap& saved, bool interrupted) override;

 private:
  // Throws InputError where two ports are given.
  ServerOptions Server() const;
  void ShowStatus();
  void Tell(const Slam& slam, const std::string& anchor, const AnchorReport& report);
  void CarryOut(const ViewerCommand& command, Slam& slam, const std::function<void()>& reset);

  std::optional<int> port_;  // --viewer, with the port where that is how it is given
  ServerOptions server_{};
  bool stays_ = false, begins_paused_ = false;
  std::vector<std::string> model_files_;
  std::shared_ptr<const ModelLibrary> models_;
  std::unique_ptr<Viewer> viewer_;
  SceneStatus status_;
  std::optional<SceneStatus> shown_;
  int steps_ = 0, frame_ = 0;
};

}  // namespace oaslam::apps
