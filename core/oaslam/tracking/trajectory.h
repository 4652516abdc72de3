#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/map/submap.h"

namespace oaslam {

// The poses of the frames so far, ordered by frame. Each is relative to a keyframe, so that it
// moves with it in later optimisations. The landmarks that a frame saw are kept for a while, so
// that its pose can be refined once the map around it has settled.
class Trajectory {
 public:
  // Adds a pose, or replaces the one the frame had. `landmarks`: the inliers by key point of
  // `frame`, invalid where there is none; may be empty.
  void Add(const FramePose& pose, const Frame& frame, const std::vector<LandmarkId>& landmarks);
  // Adds the pose of a frame by dead reckoning from another frame; it moves with that frame's pose.
  // `cam_from_other` is in units of the map.
  void AddCarried(const FramePose& pose, int other_frame, const Rigid3& cam_from_other);
  // Marks a frame as a keyframe: its pose is the keyframe's from now on.
  void MakeKeyframe(int frame_index, KeyframeId id);
  // Refines the poses of frames before `frame_index` against the landmarks they saw, at the
  // landmarks' present positions.
  void RefinePosesBefore(const Map& map, int frame_index);
  // Adds the poses of another trajectory whose keyframes were joined with this map. The added poses
  // replace poses of the same frames in this trajectory.
  void Join(Trajectory other);
  // Adds the poses of a submap that was joined with this map (AdoptPoses).
  void Adopt(const std::vector<FramePose>& poses, double scale);
  // Multiplies all lengths by `factor`, after those of the map were.
  void Scale(double factor);
  // Multiplies the lengths that are relative to each of these keyframes by its factor.
  void Scale(const std::map<KeyframeId, double>& factors);
  // Drops the oldest poses of frames after `frame_index`, so that about `most` of them remain.
  // Returns whether it has dropped any.
  bool KeepNewestAfter(int frame_index, size_t most);
  // Returns null where the frame has no pose.
  const FramePose* PoseOf(int frame_index) const;
  void Clear();

  const std::vector<FramePose>& poses() const { return poses_; }

 private:
  struct Seen {
    LandmarkId landmark;
    Eigen::Vector2f px;  // ideal image
    float scale = 1;     // of its pyramid level
  };
  struct Carried {
    int other_frame = 0;
    Rigid3 cam_from_other;
  };
  struct Unrefined {
    int frame_index = 0;
    std::shared_ptr<const Camera> camera;  // null, as `seen` is empty, where `carried` is set
    std::vector<Seen> seen;
    std::optional<Carried> carried{};
  };
  void Keep(Unrefined unrefined);
  void Refine(const Map& map, const Unrefined& unrefined, FramePose& pose);
  FramePose* Find(int frame_index) { return const_cast<FramePose*>(PoseOf(frame_index)); }
  void Put(const FramePose& pose);

  std::vector<FramePose> poses_;
  std::deque<Unrefined> unrefined_;  // ascending by frame
};

}  // namespace oaslam
