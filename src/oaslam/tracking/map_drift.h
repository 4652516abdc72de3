#pragma once

#include <map>

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

}  // namespace oaslam
