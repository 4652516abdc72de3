#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "oaslam/estimation/similarity_fit.h"
#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/map/submap.h"

namespace oaslam {

// The transformation between two submaps, and the evidence for it.
struct SubmapAlignment {
  Similarity other_from_this;
  // Frames that have a pose in both submaps: those that agree with the similarity, by points and by
  // objects, and those that do not.
  int by_points = 0, by_objects = 0, contradicting = 0;
  double relative_sigma = 0;  // of the scale

  double ShareAgreeing() const {
    const double agreeing = by_points + by_objects;
    return agreeing / (agreeing + contradicting);
  }
  // The same, seen from the other submap.
  SubmapAlignment Inverse() const {
    SubmapAlignment inverse = *this;
    inverse.other_from_this = other_from_this.Inverse();
    return inverse;
  }
};

// Collects frames that have a pose in two submaps, and estimates the similarity between the
// submaps from them. Many frames that agree determine it much better than any single one (paper,
// section "Application to AR": resuming SLAM).
class SubmapLink {
 public:
  // Adds the pose of a frame in the other submap, by objects or TrackedAt. A pose by objects may be
  // too uncertain to be shown to the user.
  void Add(int frame_index, const Relocalization& in_other);
  // Adds the pose of a keyframe that was found in the other submap, whose map is `other`. It counts
  // more than other frames, since keyframes share less of their view than successive frames and
  // their errors are less correlated. `is_soon`: the camera was in the other submap at most
  // kLongestStep before. Then points that both submaps have determine the scale, and the keyframe
  // counts most. Without this condition two keyframes that look alike by chance would suffice.
  void AddKeyframe(int frame_index, const Relocalization& found, const Map& other, bool is_soon);

  // Estimates the similarity; nothing while it is not well determined. `map` and `trajectory` are
  // those of this submap.
  std::optional<SubmapAlignment> Align(const Map& map, std::span<const FramePose> trajectory) const;

 private:
  // The depth of a landmark of the other submap that a key point shows.
  struct PointDepth {
    int keypoint = 0;
    double depth = 0;
  };
  struct Located {
    Rigid3 cam_from_other;
    double sigma = 0;  // standard deviation of the position, map units
    bool by_points = false, of_keyframe = false;
    std::vector<PointDepth> depths{};  // of a keyframe
  };

  static std::optional<ScalePrior> ScaleByPoints(const Keyframe& keyframe, const Map& map,
                                                 std::span<const PointDepth> depths);

  std::map<int, Located> located_;  // by frame
};

}  // namespace oaslam
