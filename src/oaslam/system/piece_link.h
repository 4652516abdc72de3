#pragma once

#include <map>
#include <optional>
#include <span>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/map/piece.h"
#include "oaslam/system/relocalizer.h"

namespace oaslam {

// Where a camera is in a map: by objects, whether or not the pose is good enough to be shown, or by
// points.
struct PoseAnchor {
  Rigid3 cam_from_world;
  double sigma = 0;  // of its position, map units
  bool by_points = false;
};

// Nothing where the frame was not found.
std::optional<PoseAnchor> AnchorOf(const Relocalization& found, const Map& map);

// How one piece of map lies to another, by the frames that have a pose in both. Enough of them that
// agree tell it much better than any single one (paper, section "Application to AR": resuming
// SLAM).
class PieceLink {
 public:
  // Of a frame of a video, in the other piece.
  void Add(int frame_index, const PoseAnchor& in_other) {
    anchors_.insert_or_assign(frame_index, Anchor{in_other, false});
  }
  // Of a keyframe: it shows more that is new than the next frame of a video.
  void AddKeyframe(int frame_index, const PoseAnchor& in_other) {
    anchors_.insert_or_assign(frame_index, Anchor{in_other, true});
  }

  // Of frames that were followed by points in both.
  void AddCommon(const Map& other, std::span<const FramePose> in_other,
                 std::span<const FramePose> in_this);

  // Whether it may be, if so many keyframes more are found.
  bool CanLocate(size_t keyframes) const;
  // other_from_this, once it is well determined. `map` and `trajectory`: of this piece.
  std::optional<Similarity> Locate(const Map& map, std::span<const FramePose> trajectory) const;

 private:
  struct Anchor {
    PoseAnchor in_other;
    bool of_keyframe = false;
  };
  std::map<int, Anchor> anchors_;  // by frame
};

// Whether a camera that went through both pieces moved as a camera does: where frames of one come
// shortly after frames of the other, it is neither much faster nor turns much faster than within
// them. A piece that is bent, or of a wrong scale, fits at one end only.
bool IsContinuous(const Map& map, std::span<const FramePose> trajectory, const Map& other,
                  std::span<const FramePose> other_trajectory, const Similarity& world_from_other);

}  // namespace oaslam
