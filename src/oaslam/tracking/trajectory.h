#pragma once

#include <deque>
#include <vector>

#include "oaslam/map/piece.h"

namespace oaslam {

// The poses of the frames so far, in order of the frames, each relative to a keyframe that carries
// it through later optimisation. A frame remembers for a while which landmarks it saw, and is
// refined once the map around it has settled.
class Trajectory {
 public:
  // `landmarks`: per key point of `frame`, invalid where none; what stands for the pose. May be
  // empty. Replaces a pose that the frame had.
  void Add(const FramePose& pose, const Frame& frame, const std::vector<LandmarkId>& landmarks);
  // A frame became a keyframe: its pose is the keyframe's.
  void MakeKeyframe(int frame_index, KeyframeId id);
  // Refines the frames that came before `frame_index` on the landmarks they saw, where these are
  // now.
  void Settle(const Map& map, int frame_index);
  // Takes the poses of another trajectory, whose keyframes joined this one's map `scale` times as
  // large, instead of its own for the same frames.
  void Join(Trajectory other, double scale);
  // Takes the poses of a piece that joined this one's map (AdoptPoses).
  void Adopt(const std::vector<FramePose>& poses, double scale);
  // Nothing where the frame has none.
  const FramePose* PoseOf(int frame_index) const;
  void Clear();

  const std::vector<FramePose>& poses() const { return poses_; }

 private:
  struct Seen {
    LandmarkId landmark;
    Eigen::Vector2f px;  // ideal image
    float scale = 1;     // of its pyramid level
  };
  struct Unsettled {
    int frame_index = 0, camera = 0;
    std::vector<Seen> seen;
  };
  std::vector<FramePose>::iterator Find(int frame_index);
  void Put(const FramePose& pose);

  std::vector<FramePose> poses_;
  std::deque<Unsettled> unsettled_;  // ascending by frame
};

}  // namespace oaslam
