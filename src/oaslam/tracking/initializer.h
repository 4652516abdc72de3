#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/map/command.h"
#include "oaslam/matching/descriptor_match.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Finds two frames that show the scene from far enough apart to make a map of it. Follows the key
// points of a few frames at a time, each begun where the one before had lost a part of its own: the
// view of a fast camera is soon another one, that of a slow one needs long for parallax.
class Initializer {
 public:
  explicit Initializer(const TrackingConfig& config) : config_(config) {}

  // Feeds the next frame; a map (without keyframe ids) once one can be trusted.
  std::optional<InitialMap> Process(const Frame& frame, const Camera& camera, Rng& rng);
  void Reset();
  // The frames that came before the second of the map just made, the last few seconds of them, in
  // order: to be tracked in it afterwards.
  std::vector<Frame> TakeRecent();
  // Why there is no map yet, for a user: "the camera has not moved", "too few corners", "only
  // turned".
  const std::string& why_not() const { return why_not_; }

 private:
  // A frame that may become the first of the map, and where its key points were last found.
  struct Reference {
    Frame frame;
    std::vector<Eigen::Vector2d> last_seen;  // per key point
    int matches = 0;                         // with the newest frame
    int first_matches = 0;                   // with the frame after it
    std::optional<double> last_try{};        // time of the newest frame that was too near for a map
  };

  // Matches of the two views that a map needs: fewer where the image has few corners.
  int NeededMatches(const Frame& frame) const;
  KeypointPairs Follow(Reference& reference, const Frame& frame, const Camera& camera) const;
  std::optional<InitialMap> Try(const Reference& reference, const Frame& frame,
                                const Camera& camera, const KeypointPairs& pairs, Rng& rng);

  TrackingConfig config_;
  std::deque<Reference> references_;  // oldest first
  std::deque<Frame> recent_;          // the newest included
  std::string why_not_;
};

}  // namespace oaslam
