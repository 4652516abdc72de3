#pragma once

#include <map>
#include <set>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The firm parts of a map: the connected components of its covisibility graph, in which only
// keyframes that share enough landmarks are connected. A few landmarks, or the camera's motion
// alone, as in a narrow door, hardly constrain the scale: the part behind such a link may have
// another scale until the camera sees it from elsewhere. After a loop or a joining, three objects
// that two parts see connect them, too, since the submaps of a camera that was lost are joined by
// such objects. A motion whose length a sensor tells connects two keyframes, too. The part with the
// most keyframes is the main one, so that a bad beginning of a map does not make all later
// keyframes uncertain.
class FirmParts {
 public:
  // Whether a keyframe is in another part than the main one. Looks at all keyframes only after a
  // loop or a joining.
  bool IsLoose(const Map& map, KeyframeId id);

 private:
  struct Node {
    KeyframeId parent;
    int keyframes = 1;  // of a root: in its component
  };

  void LookAtAll(const Map& map);
  void Connect(const Map& map, KeyframeId id);
  void ConnectByObjects(const Map& map);
  void Unite(KeyframeId one, KeyframeId other);
  KeyframeId RootOf(KeyframeId id);

  std::map<KeyframeId, Node> nodes_;
  std::set<KeyframeId> seen_;  // keyframes that were looked at
  KeyframeId main_;
  int loops_closed_ = 0;
};

// Successive keyframes that are in another firm part than the main one.
struct LooseStretch {
  double from_s = 0, to_s = 0;  // time stamps
  int shared = 0;               // landmarks of the strongest link to the main part
  double link_s = 0;            // time stamp of the keyframe with this link
};
// The loose stretches among the keyframes from frame `first_frame` on, by time.
std::vector<LooseStretch> LooseStretches(const Map& map, int first_frame);

}  // namespace oaslam
