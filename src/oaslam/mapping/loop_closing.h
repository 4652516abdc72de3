#pragma once

#include <optional>
#include <set>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// A keyframe that came back to a part of the map it is not connected with.
struct LoopClosure {
  KeyframeId current, old;
  Similarity old_from_current;  // moves what lies at `current` to where it belongs
  std::vector<std::pair<uint32_t, LandmarkId>>
      old_landmarks;  // key points of `current` that show them
};

// Recognises places. Keeps an index of the map's landmarks, made anew now and then as the map
// grows.
class LoopDetector {
 public:
  // Candidates are keyframes near `current` in space and direction, and those whose landmarks look
  // alike, that share nothing with it and its neighbours. Descriptors, P3P and a guided search
  // verify that it sees their landmarks; where only looks speak for a candidate, a similarity must
  // also take landmarks of both ends to each other.
  std::optional<LoopClosure> Detect(const Map& map, KeyframeId current, Rng& rng);

 private:
  std::vector<Place> LookingAlike(
      const Map& map, KeyframeId current);  // best first; may hold places around `current`

  std::optional<PlaceIndex> index_;
  uint32_t indexed_up_to_ = 0;  // Map::next_landmark when the index was made
};

// Where a keyframe of one piece of a map meets one of the `others`, of a piece that was joined with
// it: both lie where they should but for small errors, and share no landmarks yet.
std::optional<LoopClosure> FindTie(const Map& map, KeyframeId current,
                                   const std::set<KeyframeId>& others, Rng& rng);

// Spreads the correction over the keyframes around the loop by a pose graph of similarities
// (Strasdat et al. 2010); landmarks and objects move with their keyframes. Then joins the landmarks
// of both ends. What is left to do is a global bundle adjustment. False, and the map as it was, if
// no correction was found. `held`: a keyframe that stays where it is, besides; the first one if
// there is none.
bool CorrectLoop(const LoopClosure& loop, int min_shared_landmarks, Map& map, KeyframeId held = {});

}  // namespace oaslam
