#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/map/relocalization.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/relocalization/object_trails.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The inputs of a search for a frame. The objects that it refers to must outlive the search.
struct SearchTools {
  const SlamConfig& config;
  const PlaceIndex* places;  // null: landmarks are not looked for
  RelocalizationMode mode;
  Rng& rng;
  ObjectTrails* trails = nullptr;  // as for Relocalizer::Find
};

class FrameSearch {
 public:
  FrameSearch(const SearchTools& tools, const Map& map) : tools_(tools), map_(map) {}

  // Searches landmarks around a supposed pose; nothing where they do not confirm the pose.
  std::optional<Relocalization> Near(const Frame& frame, const Rigid3& cam_from_world) const;
  // Searches by ORB. Where this fails, searches again in the frame with learned descriptors, if
  // `learned` gives one.
  Relocalization Find(const Frame& frame, const std::function<std::optional<Frame>()>& learned);

 private:
  // Searches by objects, if their pose is confident and points confirm it; else by points that are
  // compared by `appearance`, at places that this pose may see; else by objects with a less
  // confident pose.
  Relocalization By(Appearance appearance, const Frame& frame);
  // Searches landmarks around a pose from another source, whose error in the image is at most the
  // angle `error_rad`.
  Relocalization Confirmed(const Frame& frame, const Rigid3& cam_from_world,
                           double error_rad) const;
  Relocalization ByPoints(const Frame& frame, Appearance appearance,
                          const std::optional<Rigid3>& roughly) const;
  std::optional<Relocalization> BySureObjects(const Frame& frame);
  Relocalization ByObjects(const Frame& frame);
  // Whether a keyframe near this pose sees so many landmarks that a frame with as many key points
  // should match them.
  bool IsMappedFrom(const Frame& frame, const Rigid3& cam_from_world) const;
  // Refines a pose that few points support by the objects in view. (Not in the paper, which refines
  // with points.) Returns how many objects agree with the points; nothing where the points suffice.
  std::optional<size_t> JoinObjects(const Frame& frame, Relocalization& found) const;
  const std::vector<Relocalization>& PosesByObjects(const Frame& frame);
  std::vector<Relocalization> SearchPosesByObjects(const Frame& frame) const;
  bool IsAsInPaper() const { return tools_.config.relocalization.objects == ObjectMethod::kPaper; }

  SearchTools tools_;
  const Map& map_;
  std::optional<std::vector<Relocalization>> poses_by_objects_;  // best first; once searched
};

// As FrameSearch::Find, for a frame whose camera is not known (Relocalizer::FindWithUnknownCamera).
Relocalization FindWithUnknownCamera(const SearchTools& tools, const Map& map, const Frame& raw,
                                     const std::function<std::optional<Frame>()>& learned);

// Puts the accepted pose, which is one of the candidates or a refinement of one, in front of them.
void LeadWithAccepted(Relocalization& found);

}  // namespace oaslam
