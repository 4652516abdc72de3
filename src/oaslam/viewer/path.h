#pragma once

#include <array>
#include <vector>

#include "oaslam/map/map.h"
#include "oaslam/viewer/message.h"

namespace oaslam {

// The poses of the frames, each carried by its keyframe: they move with the map, and only those
// that moved are sent again.
class Path {
 public:
  // The keyframe that carries it may come with a later map.
  void Add(const FramePose& pose, const Map& map);
  void Replace(const std::vector<FramePose>& poses, const Map& map);
  // Takes the poses from this map.
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
    uint64_t changed = 0;  // version; 0: its keyframe has not come yet
  };
  std::vector<FramePose> poses_;
  std::vector<Point> points_;  // parallel
  uint64_t version_ = 1;
  uint64_t begun_ = 1;  // version at which all before was forgotten
};

}  // namespace oaslam
