#pragma once

#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The similarity that takes points about a keyframe from a map to an earlier state of it, by the
// poses that the keyframe has, or is resolved to, in both. The scale is the median ratio of the
// distances from it and its neighbours to what their key points show; 1 where no key point shows a
// landmark in both.
Similarity MotionToEarlier(const Map& now, const Map& earlier, KeyframeId about);

// Poses that were stored relative to keyframes after a loop was closed, which turned out to be
// wrong. Their reference may be at the other end of the loop, where the camera was not. This makes
// them relative to the keyframe that was made shortly before, as it is in the restored map.
struct LaterPoses {
  struct Carrier {
    int frame_index = 0;
    KeyframeId id;
    Rigid3 cam_from_world;  // in the bent map
    double scale = 1;       // one unit of the bent map in those of the restored one, about here
  };
  std::shared_ptr<const Map> bent;
  std::vector<Carrier> carriers;  // ascending by frame; the first closed the loop

  // Changes nothing for frames up to the closing of the loop, and where the reference is unknown.
  void Restore(int frame_index, KeyframeId& reference, Rigid3& cam_from_reference) const;
  // That of the frame; the first for earlier ones.
  const Carrier& CarrierOf(int frame_index) const;
};

}  // namespace oaslam
