#pragma once

#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/command.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Finds two frames that show the scene from far enough apart to make a map of it. Holds the first frame and where its key points
// have gone since.
class Initializer {
 public:
  explicit Initializer(const TrackingConfig& config) : config_(config) {}

  // Feeds the next frame; a map (without keyframe ids) once one can be trusted. Starts over when the first frame is lost from sight.
  std::optional<InitialMap> Process(const Frame& frame, const Camera& camera, Rng& rng);
  void Reset() { first_.reset(); }
  // The frames between the two of the map just made, to be tracked in it afterwards.
  std::vector<Frame> TakeBetween() { return std::move(between_); }

 private:
  void Start(const Frame& frame);

  TrackingConfig config_;
  std::optional<Frame> first_;
  std::vector<Frame> between_;              // frames since, the newest excluded
  std::vector<Eigen::Vector2d> last_seen_;  // per key point of the first frame: where it was last found
};

}  // namespace oaslam
