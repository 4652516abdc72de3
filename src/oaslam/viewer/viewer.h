#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/formats/class_names.h"
#include "oaslam/formats/trajectory_file.h"
#include "oaslam/viewer/frame_record.h"
#include "oaslam/viewer/scene.h"
#include "oaslam/viewer/viewer_session.h"

namespace oaslam {

struct ViewerOptions {
  std::string address = "127.0.0.1";
  int port = 0;                                            // 0: any that is free
  bool accepts_commands = false, accepts_anchors = false;  // of pages on this machine
  std::shared_ptr<const ModelLibrary> models{};  // virtual content that may be placed; none without
  ClassNames names{};
  // Ground truth in the map's frame, from the trajectory so far; empty: none. Called on the
  // viewer's thread.
  std::function<std::vector<StampedPose>(const std::vector<StampedPose>&)> align_groundtruth{};
};

// Shows a map in any number of browsers, on a thread of its own. What is handed to it is shared,
// not copied; the caller never waits for a viewer.
class Viewer {
 public:
  // Listens from now on. Throws InputError (Server).
  explicit Viewer(ViewerOptions options);
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  std::string url() const;

  void Show(FrameRecord record);
  void ShowMap(std::shared_ptr<const Map> map, std::vector<FramePose> trajectory);
  // The same map, edited.
  void UpdateMap(std::shared_ptr<const Map> map);
  void ShowNotes(std::vector<FrameNote> notes);
  void ShowPicture(int frame_index, cv::Mat image);  // waits while many are waiting
  void ShowStatus(const SceneStatus& status);
  void ShowEvent(int frame, const std::string& kind, const std::string& text);
  // After a reset: all that was shown is no longer so.
  void Clear();

  // Those since the last call; waits for one, but no longer than `wait_ms`. At most 64 are kept:
  // that more were asked for is an event, which pages show.
  std::vector<ViewerCommand> TakeCommands(int wait_ms = 0);

  // Gives viewers a moment to take what there is, and ends. Idempotent.
  void Shutdown();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace oaslam
