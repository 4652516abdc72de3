#include "oaslam/localization/relocalizer.h"

#include <functional>
#include <utility>

#include "oaslam/description/describe_features.h"
#include "oaslam/localization/frame_search.h"

namespace oaslam {
namespace {

// The frame with learned descriptors of all its key points.
Frame WithLearned(const Frame& frame, const Map& map) {
  Frame described = frame;
  if (frame.image)
    described.features = std::make_shared<const Features>(Described(
        *frame.features, map.cameras[static_cast<size_t>(frame.camera)], frame.image->view()));
  return described;
}

// By ORB; where that is in vain by learned descriptors, if the map has some and the frame can have.
Relocalization FindInTurn(const Frame& frame, const Map& map, const PlaceIndex* places,
                          const std::function<Relocalization(Appearance, const Frame&)>& find) {
  Relocalization found = find(Appearance::kOrb, frame);
  const bool has_learned = places && places->Has(Appearance::kLearned) &&
                           (frame.image || !frame.features->learned.empty());
  if (!found.IsFound() && has_learned) {
    Relocalization by_learned = find(Appearance::kLearned, WithLearned(frame, map));
    if (by_learned.IsFound() || by_learned.confidence > found.confidence)
      found = std::move(by_learned);
  }
  LeadWithAccepted(found);
  return found;
}

}  // namespace

bool LandmarkIndex::IsOf(const Map& map) const {
  bool are_same = true;  // compares pages, not landmarks
  landmarks.ForEachDifference(
      map.landmarks, [&](LandmarkId, const Landmark*, const Landmark*) { are_same = false; });
  return are_same;
}

// Null where points are not to be used.
const PlaceIndex* Relocalizer::IndexFor(const Frame& frame, const Map& map,
                                        RelocalizationMode mode) {
  if (mode == RelocalizationMode::kObjects || !frame.features) return nullptr;
  if (!index_ || !index_->IsOf(map)) index_ = std::make_shared<const LandmarkIndex>(map);
  return &index_->places;
}

Relocalization Relocalizer::Find(const Frame& frame, const Map& map, RelocalizationMode mode,
                                 Rng& rng, ObjectTrails* trails,
                                 const std::optional<Rigid3>& prior) {
  const SearchTools tools{config_, IndexFor(frame, map, mode), mode, rng, trails};
  FrameSearch search(tools, map);
  if (prior && tools.places)
    if (std::optional<Relocalization> near = search.Near(frame, prior->Inverse()))
      return *std::move(near);
  return FindInTurn(frame, map, tools.places, [&](Appearance appearance, const Frame& with) {
    return search.By(appearance, with);
  });
}

Relocalization Relocalizer::FindWithUnknownCamera(const Frame& raw, const Map& map,
                                                  RelocalizationMode mode, Rng& rng) {
  const SearchTools tools{config_, IndexFor(raw, map, mode), mode, rng};
  return FindInTurn(raw, map, tools.places, [&](Appearance appearance, const Frame& with) {
    return oaslam::FindWithUnknownCamera(tools, map, with, appearance);
  });
}

}  // namespace oaslam
