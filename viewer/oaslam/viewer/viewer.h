#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/content/model_library.h"
#include "oaslam/net/http_server.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/viewer/frame_record.h"
#include "oaslam/viewer/scene.h"
#include "oaslam/viewer/viewer_command.h"

namespace oaslam {

struct ViewerOptions {
  ServerOptions server{};
  // Whether pages on this machine, or with a token to write, may send them.
  bool accepts_commands = false, accepts_anchors = false;
  // Virtual content that may be placed; null: none.
  std::shared_ptr<const ModelLibrary> models{};
  ClassNames names{};
  // Returns the ground truth in the map's frame, given the trajectory so far; empty: none. Called
  // on the viewer's thread.
  std::function<std::vector<StampedPose>(const std::vector<StampedPose>&)> align_groundtruth{};
};

// Shows a map in any number of browsers, on a thread of its own. Large content is shared and not
// copied; the caller does not wait for viewers (but see ShowPicture).
class Viewer {
 public:
  static constexpr int kMaxConnections = 64;  // each gets all pictures

  // Starts to listen. Throws InputError as HttpServer does.
  explicit Viewer(ViewerOptions options);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  std::string url() const;

  void Show(FrameRecord record);
  void ShowMap(std::shared_ptr<const Map> map, std::vector<FramePose> trajectory);
  // Replaces the map by an edited one.
  void UpdateMap(std::shared_ptr<const Map> map);
  void ShowNotes(std::vector<FrameNote> notes);
  void ShowPicture(int frame_index, cv::Mat image);  // blocks while many pictures are queued
  void ShowStatus(const SceneStatus& status);
  void ShowEvent(int frame, const std::string& kind, const std::string& text);
  // Removes everything that is shown, as after a reset.
  void Clear();

  // The commands since the last call; waits up to `wait_ms` for one. At most 64 are kept; pages get
  // an event if more were sent.
  std::vector<ViewerCommand> TakeCommands(int wait_ms = 0);

  // Gives viewers a moment to receive everything, and ends. Idempotent.
  void Shutdown();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace oaslam
