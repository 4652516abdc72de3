#include "oaslam/relocalization/relocalizer.h"

#include <memory>
#include <utility>

#include "oaslam/description/describe_features.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/relocalization/frame_search.h"

namespace oaslam {
namespace {

// The frame with learned descriptors of all its key points; nothing where the map has none, or the
// frame cannot have any.
std::optional<Frame> WithLearned(const Frame& frame, const PlaceIndex* places) {
  const bool is_possible = places && places->Has(Appearance::kLearned) &&
                           (frame.image || !frame.features->learned.empty());
  if (!is_possible) return std::nullopt;
  Frame described = frame;
  if (frame.image)
    described.features = std::make_shared<const Features>(
        DescribeFeatures(*frame.features, *frame.camera, frame.image->view()));
  return described;
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
  return search.Find(frame, [&] { return WithLearned(frame, tools.places); });
}

Relocalization Relocalizer::FindWithUnknownCamera(const Frame& raw, const Map& map,
                                                  RelocalizationMode mode, Rng& rng) {
  const SearchTools tools{config_, IndexFor(raw, map, mode), mode, rng};
  return oaslam::FindWithUnknownCamera(tools, map, raw,
                                       [&] { return WithLearned(raw, tools.places); });
}

Relocalization Relocalizer::FindWithFreeFocal(const Frame& frame, const Map& map, Rng& rng) {
  const PlaceIndex* places = IndexFor(frame, map, RelocalizationMode::kPoints);
  if (!places) return {};
  return RelocalizeByPointsAndFocal(frame, map, *places, config_.relocalization, rng);
}

}  // namespace oaslam
