#pragma once

#include <map>
#include <optional>

#include "oaslam/map/map.h"

namespace oaslam {

// How far a map may be bent between its first keyframe and the others. Views that share all
// landmarks know each other's place; each new view is known by what it shares with those before,
// and its error is added to theirs. So errors grow along the shortest chain of views to a keyframe,
// and a loop, which makes chains shorter, takes them back.
class MapDrift {
 public:
  // The length of the shortest chain of views from the first keyframe to this one: a link between
  // views that share nothing has length 1. It is the variance of the keyframe's place in these
  // units. Looks at all keyframes after a loop or a joining only.
  double LinksTo(const Map& map, KeyframeId id);

 private:
  void LinkAll(const Map& map);

  std::map<KeyframeId, double> links_;
  int loops_closed_ = 0;
};

// Whether the map may have parted from what was mapped before: the camera passes where next to
// nothing of the map is in view, or many points of the odometry do not agree on a pose. What is
// mapped from then on may have another scale, until a shorter chain of views leads to the first
// keyframe. Which of the two sides is in doubt is a matter of what the world is: that of the longer
// one leads, so that a map that began badly does not doubt all that follows.
class Parting {
 public:
  struct Image {
    double timestamp = 0;
    int inliers = 0;                    // landmarks
    double agreeing = 1;                // FrameMotion
    double links = 0;                   // MapDrift, of the keyframe that shares most with it
    int frame = 0, keyframe_frame = 0;  // frame indices of the image, and of that keyframe
  };
  // Whether what the image sees may have parted.
  bool Update(const Image& image);

 private:
  std::optional<double> few_since_;  // time
  std::optional<double> links_;      // at the parting
  int frame_ = 0, last_frame_ = 0;   // of the first image of it, and of the last
  bool later_leads_ = false;         // what came after has lasted longer
};

}  // namespace oaslam
