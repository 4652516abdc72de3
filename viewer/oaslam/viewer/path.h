#pragma once

#include <array>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// The poses of the frames, relative to keyframes: they move with the map, and only changed ones are
// sent again.
class Path {
 public:
  // The keyframe of the pose may be missing until a later map.
  void Add(const FramePose& pose, const Map& map);
  void Replace(const std::vector<FramePose>& poses, const Map& map);
  // Updates all poses from this map.
  void Update(const Map& map);
  void Clear();

  // Adds what changed since `version`, and returns the newest version.
  uint64_t AddDelta(uint64_t version, MessageBuilder& message) const;
  uint64_t version() const { return version_; }
  bool empty() const { return poses_.empty(); }
  const std::vector<FramePose>& poses() const { return poses_; }

 private:
  struct Point {
    std::array<float, 7> world_from_cam{};
    uint64_t changed = 0;  // version of the last change; 0: its keyframe is not in the map yet
  };
  std::vector<FramePose> poses_;
  std::vector<Point> points_;  // parallel
  uint64_t version_ = 1;
  uint64_t begun_ = 1;  // version at the last Clear
};

}  // namespace oaslam
