#pragma once

#include <functional>
#include <future>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/mapping/loop_proposals.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A keyframe that sees an older part of the map with which it shares no landmarks.
struct LoopClosure {
  KeyframeId current, old;
  Similarity old_from_current;  // maps points near `current` to their correct places
  // Key points of `current`, and the landmarks of the old part that they show.
  std::vector<std::pair<uint32_t, LandmarkId>> old_landmarks;
  // Whether both parts see enough of the same points, or objects, to determine the scale; if not,
  // the scale of `old_from_current` is 1.
  bool is_scale_known = true;
};

// Where a camera was and which way it looked, in the world.
struct KeyframePlace {
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), axis = Eigen::Vector3d::UnitZ();
};

// Detects loops. Keeps the places of the keyframes, and an index of the map's landmarks that is
// rebuilt when the map has grown. For a large map its own thread rebuilds it, so that no keyframe
// waits; it is used after a fixed number of keyframes, so that results do not depend on timing.
class LoopDetector {
 public:
  // Candidates are keyframes that share no landmarks with `current` and its neighbours, and that
  // are near to it in position and viewing direction, similar in appearance, or proposed by objects
  // that were mapped twice (loop_proposals.h). A candidate is verified by matching descriptors, P3P
  // and a guided search for its landmarks. A candidate that is not near must also have a similarity
  // that maps landmarks of one end to those of the other. Where objects propose it, points are also
  // searched around the pose from objects, since another view changes descriptors, and must confirm
  // that pose. The objects around both ends must not refute the loop (loop_objects.h).
  std::optional<LoopClosure> Detect(const Map& map, KeyframeId current, Rng& rng);

 private:
  std::vector<Place> LookingAlike(
      const Map& map, KeyframeId current);  // best first; may contain places around `current`

  std::optional<LoopClosure> DetectByObjects(const Map& map, KeyframeId current,
                                             const std::function<bool(KeyframeId)>& is_candidate);

  void UpdatePlaces(const Map& map);
  void UpdateIndex(const Map& map, KeyframeId current);

  std::optional<PlaceIndex> index_;
  uint32_t indexed_up_to_ = 0;  // Map::next_landmark when the newest index was made, or begun
  std::future<PlaceIndex> next_index_;
  KeyframeId next_begun_at_;
  Table<KeyframeId, Keyframe> known_;           // as of the last call
  std::map<KeyframeId, KeyframePlace> places_;  // of `known_`
  LoopProposals proposals_;
};

// Finds a keyframe among `others` that sees the same place as `current`. `others` belong to another
// submap that was just joined: they share no landmarks with `current` yet, and their relative pose
// has small errors only.
std::optional<LoopClosure> FindTie(const Map& map, KeyframeId current,
                                   const std::set<KeyframeId>& others, Rng& rng);

// Distributes the correction over the keyframes by a pose graph of similarities (Strasdat et al.
// 2010); landmarks and objects move with their keyframes. Then merges the landmarks of both ends. A
// global bundle adjustment should follow. `held`: a keyframe that stays fixed, as both ends of the
// loop do; if it is invalid, the first one. Returns false and leaves the map as it was if no
// correction was found.
bool CorrectLoop(const LoopClosure& loop, Map& map, KeyframeId held = {});

}  // namespace oaslam
