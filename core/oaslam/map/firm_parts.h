#pragma once

#include <map>
#include <set>
#include <vector>

#include "oaslam/map/map.h"

namespace oaslam {

// The parts of a map that are firm in themselves: the connected components of its covisibility
// graph, in which two keyframes are connected that share enough landmarks. A few landmarks, or the
// camera's motion alone, as in a narrow door, hardly hold the scale: what lies behind such a link
// may have another one, until it is seen from elsewhere. After a loop or a joining, three objects
// that two parts see tie them, too: by such the submaps of a camera that was lost are joined. The
// part with the most keyframes is the main one, so that a map that began badly does not doubt all
// that follows.
class FirmParts {
 public:
  // Whether a keyframe is in another part than the main one. Looks at all keyframes after a loop
  // or a joining only.
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

// Keyframes that follow each other in time and are in another firm part than the main one.
struct LooseStretch {
  double from_s = 0, to_s = 0;  // time stamps
  int shared = 0;               // landmarks, of the link to the main part that has the most
  double link_s = 0;            // time stamp of the keyframe of the stretch that has this link
};
// Of the keyframes from this image on, by time.
std::vector<LooseStretch> LooseStretches(const Map& map, int first_frame);

}  // namespace oaslam
