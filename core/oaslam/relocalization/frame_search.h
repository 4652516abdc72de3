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

// What a frame is looked for with. What it refers to must outlive the search.
struct SearchTools {
  const SlamConfig& config;
  const PlaceIndex* places;  // null: landmarks are not looked for
  RelocalizationMode mode;
  Rng& rng;
  ObjectTrails* trails = nullptr;  // as for Relocalizer::Find
};

// The search for one frame in a map.
class FrameSearch {
 public:
  FrameSearch(const SearchTools& tools, const Map& map) : tools_(tools), map_(map) {}

  // Around a supposed pose; nothing where landmarks do not confirm it.
  std::optional<Relocalization> Near(const Frame& frame, const Rigid3& cam_from_world) const;
  // By ORB. Where that is in vain, in the frame with learned descriptors, if `learned` gives one.
  Relocalization Find(const Frame& frame, const std::function<std::optional<Frame>()>& learned);

 private:
  // By objects that are sure of a pose; where points do not confirm it, by points that are compared
  // by `appearance`, at places that this pose may see; then by objects that are less sure.
  Relocalization By(Appearance appearance, const Frame& frame);
  // By landmarks around a pose from another source, which may be off by this angle in the image.
  Relocalization Confirmed(const Frame& frame, const Rigid3& cam_from_world,
                           double error_rad) const;
  Relocalization ByPoints(const Frame& frame, Appearance appearance,
                          const std::optional<Rigid3>& roughly) const;
  std::optional<Relocalization> BySureObjects(const Frame& frame);
  Relocalization ByObjects(const Frame& frame);
  // Whether images of the map show from about this pose what a frame with as many key points would
  // share with them.
  bool IsMappedFrom(const Frame& frame, const Rigid3& cam_from_world) const;
  // Refines a pose that few points support by the objects in view. (Not in the paper, which refines
  // with points.) Returns how many objects agree with the points; nothing where these suffice.
  std::optional<size_t> JoinObjects(const Frame& frame, Relocalization& found) const;
  const std::vector<Relocalization>& PosesByObjects(const Frame& frame);
  std::vector<Relocalization> SearchPosesByObjects(const Frame& frame) const;
  bool IsAsInPaper() const { return tools_.config.relocalization.objects == ObjectMethod::kPaper; }

  SearchTools tools_;
  const Map& map_;
  std::optional<std::vector<Relocalization>> poses_by_objects_;  // best first; once searched
};

// The same for a frame whose camera is not known, as Relocalizer::FindWithUnknownCamera.
Relocalization FindWithUnknownCamera(const SearchTools& tools, const Map& map, const Frame& raw,
                                     const std::function<std::optional<Frame>()>& learned);

// Puts the accepted pose, which is one of the candidates or a refinement of one, in front of them.
void LeadWithAccepted(Relocalization& found);

}  // namespace oaslam
