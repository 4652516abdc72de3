#pragma once

#include <memory>
#include <optional>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/relocalization/landmark_index.h"
#include "oaslam/relocalization/object_trails.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Finds frames in a map, independently of each other (paper, section "Relocalization using
// Objects"): by objects that are sure of a pose and points that confirm it, by points, or by
// objects whose pose guides the search for points; and by objects alone as a last resort, if their
// evidence is strong. The search uses ORB first, and learned descriptors where ORB finds no pose.
class Relocalizer {
 public:
  // `index`: the index of a map in which frames will be searched; the relocalizer makes the index
  // of any other map when it needs it.
  explicit Relocalizer(const SlamConfig& config,
                       std::shared_ptr<const LandmarkIndex> index = nullptr)
      : config_(config), index_(std::move(index)) {}

  // Uses an index of the map that was made elsewhere.
  void Use(std::shared_ptr<const LandmarkIndex> index) { index_ = std::move(index); }

  // A frame without features is found by objects only. `trails`: the evidence of objects in earlier
  // frames, which counts, too (not by the paper's method); null to find each frame by itself.
  // `prior`: the camera's supposed pose, world_from_cam; landmarks are looked for around it first.
  Relocalization Find(const Frame& frame, const Map& map, RelocalizationMode mode, Rng& rng,
                      ObjectTrails* trails = nullptr,
                      const std::optional<Rigid3>& prior = std::nullopt);

  // Finds a frame whose camera is not known, and its camera. `raw` holds key points and boxes of
  // the original image, and its camera in `map` gives the image's size and has no distortion; the
  // focal length of that camera is not used. First tries each camera of the map that fits the
  // image's size. Where the points contradict it, or nothing is found, estimates the focal length
  // together with the pose, by ORB or (where all else is in vain) by learned descriptors.
  Relocalization FindWithUnknownCamera(const Frame& raw, const Map& map, RelocalizationMode mode,
                                       Rng& rng);
  // Finds a frame by points, whatever its focal length, which is estimated.
  Relocalization FindWithFreeFocal(const Frame& frame, const Map& map, Rng& rng);

 private:
  const PlaceIndex* IndexFor(const Frame& frame, const Map& map, RelocalizationMode mode);

  SlamConfig config_;
  std::shared_ptr<const LandmarkIndex> index_;  // null: none yet
};

}  // namespace oaslam
