#include "live_view.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <utility>

#include "common.h"
#include "oaslam/evaluation/trajectory_metrics.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/util/bad_input.h"
#include "server_options.h"

namespace oaslam::apps {
namespace {

constexpr int kCheckMs = 100;  // milliseconds between checks for Ctrl-C

}  // namespace

decltype(ViewerOptions::align_groundtruth) AlignerOf(const std::vector<StampedPose>& groundtruth) {
  if (groundtruth.empty()) return nullptr;
  return [groundtruth](const std::vector<StampedPose>& trajectory) -> std::vector<StampedPose> {
    constexpr size_t kMinPoses = 20;  // fewer poses do not determine the scale well
    if (trajectory.size() < kMinPoses) return {};
    const TrajectoryReport report = EvaluateTrajectory(groundtruth, trajectory, AlignMode::kSim3);
    if (!report.success) return {};
    return Aligned(groundtruth, report.reference_from_estimate.Inverse());
  };
}

void LiveView::AddOptions(CLI::App& run) {
  // A number is accepted, as before there was --port, but help shows none.
  auto* viewer = run.add_option("--viewer", port_, "serve a page that shows the run")
                     ->type_name("")
                     ->check(CLI::Range(0, 65535).description(""));
  AddPortOption(run, server_)->needs(viewer);
  AddServerOptions(run, server_);
  run.add_flag("--viewer-stay", stays_, "go on serving the finished map until Ctrl-C")
      ->needs(viewer);
  run.add_flag("--viewer-paused", begins_paused_, "wait for a viewer to start the run")
      ->needs(viewer);
  AddModelOption(run, model_files_)->needs(viewer);
}

int LiveView::PortIfLeftOut() const { return kViewerPort; }

ServerOptions LiveView::Server() const {
  ServerOptions server = server_;
  if (*port_ == kViewerPort) return server;
  if (server.port != kViewerPort && server.port != *port_)
    throw BadInput("--viewer {}: --port {} gives another port", *port_, server.port);
  server.port = *port_;
  return server;
}

void LiveView::Check() {
  if (!port_) return;
  models_ = std::make_shared<const ModelLibrary>(model_files_);
  CheckServer(Server());
}

void LiveView::Begin(const std::string& title, const Slam& slam,
                     const std::vector<StampedPose>& groundtruth, bool quiet) {
  if (!port_) return;
  ViewerOptions options{.server = Server(),
                        .accepts_commands = true,
                        .accepts_anchors = true,
                        .models = models_,
                        .names = slam.Snapshot().CategoryNames(),
                        .align_groundtruth = AlignerOf(groundtruth)};
  viewer_ = std::make_unique<Viewer>(std::move(options));
  status_ = {.live = true, .paused = begins_paused_, .title = title};
  ShowStatus();
  if (!quiet) spdlog::info("viewer: {}", viewer_->url());
}

void LiveView::ShowStatus() {
  if (shown_ == status_) return;
  viewer_->ShowStatus(status_);
  shown_ = status_;
}

void LiveView::CarryOut(const ViewerCommand& command, Slam& slam,
                        const std::function<void()>& reset) {
  using Kind = ViewerCommand::Kind;
  switch (command.kind) {
    case Kind::kPause:
      status_.paused = command.on;
      break;
    case Kind::kStep:
      ++steps_;
      break;
    case Kind::kReset:
      reset();
      slam.SetMapping(status_.mapping);
      viewer_->Clear();
      viewer_->ShowEvent(frame_, "reset", "by a viewer");
      break;
    case Kind::kRelocalize:
      slam.ForceRelocalization();
      viewer_->ShowEvent(frame_, "lost", "relocalization forced by a viewer");
      break;
    case Kind::kMapping:
      status_.mapping = command.on;
      slam.SetMapping(command.on);
      break;
    case Kind::kPlaceAnchor: {
      const AnchorReport report = slam.PlaceAnchor(command.place);
      Tell(slam, report.name, report);
      break;
    }
    case Kind::kEditAnchor:
      Tell(slam, command.anchor, slam.EditAnchor(command.anchor, command.edit));
      break;
    case Kind::kRemoveAnchor:
      Tell(slam, command.anchor, slam.RemoveAnchor(command.anchor));
      break;
  }
}

// Shows the result of a request for an anchor, also while the run is paused.
void LiveView::Tell(const Slam& slam, const std::string& anchor, const AnchorReport& report) {
  if (report.IsDone())
    viewer_->UpdateMap(MapOf(slam.Snapshot()));
  else
    viewer_->ShowEvent(
        frame_, "anchor",
        anchor.empty() ? report.why_not : fmt::format("{}: {}", anchor, report.why_not));
}

double LiveView::Obey(Slam& slam, const std::function<void()>& reset) {
  if (!viewer_) return 0;
  const auto start = std::chrono::steady_clock::now();
  int wait_ms = 0;
  do {
    for (const ViewerCommand& command : viewer_->TakeCommands(wait_ms))
      CarryOut(command, slam, reset);
    ShowStatus();
    wait_ms = kCheckMs;
  } while (status_.paused && steps_ == 0 && !Interrupted());
  if (!status_.paused) steps_ = 0;
  if (steps_ > 0) --steps_;
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void LiveView::Show(const Slam& slam, const FrameInput& frame, const TrackingResult& result,
                    int dropped) {
  if (!viewer_) return;
  frame_ = result.frame;
  FrameRecord record = RecordOf(slam, result);
  record.image = frame.input.image;
  record.image_path = frame.path;
  record.image_orientation = frame.orientation;
  viewer_->Show(std::move(record));
  status_.dropped = dropped;
}

void LiveView::Finish(const SavedMap& saved, bool interrupted) {
  if (!viewer_) return;
  status_.live = status_.paused = false;
  status_.recordings = saved.recordings;
  viewer_->ShowMap(std::make_shared<const Map>(saved.map), saved.trajectory);
  ShowStatus();
  viewer_->ShowEvent(frame_, "map", interrupted ? "interrupted" : "finished");
  if (stays_ && !interrupted) {
    spdlog::info("finished; the viewer stays at {} until Ctrl-C", viewer_->url());
    while (!Interrupted())
      for (const ViewerCommand& command : viewer_->TakeCommands(kCheckMs))
        if (command.IsOfAnchors())
          viewer_->ShowEvent(frame_, "anchor", "the run is over: open its map with oaslam view");
  }
  viewer_->Shutdown();
}

}  // namespace oaslam::apps
