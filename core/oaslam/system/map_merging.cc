#include "oaslam/system/map_merging.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/map/joining.h"
#include "oaslam/map/next_ids.h"
#include "oaslam/map/renumbering.h"
#include "oaslam/map/scale_drift.h"
#include "oaslam/mapping/submap_joining.h"
#include "oaslam/objects/moved_objects.h"
#include "oaslam/objects/scale_estimate.h"
#include "oaslam/system/keyframe_search.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

// Two walks may share one room of many, so that nearly all keyframes are looked for.
constexpr SearchEffort kEffort{.max_keyframes = 400,
                               .max_in_vain = std::numeric_limits<size_t>::max()};

Renumbering NumbersBehind(const SavedMap& a, const SavedMap& b) {
  Renumbering numbers;
  numbers.first = NextIdsOf(a.map);
  for (const Submap& submap : a.submaps)
    numbers.first = Behind(numbers.first, NextIdsOf(submap.map));
  numbers.first_frame = FramesOf(a);
  numbers.cameras = a.map.cameras;
  numbers.camera_of = CameraNumbers(b.map.cameras, numbers.cameras);
  return numbers;
}

ClassNames NamesOfBoth(const ClassNames& a, const ClassNames& b) {
  ClassNames names = a;
  for (const auto& [category, name] : b) {
    const auto [place, is_new] = names.emplace(category, name);
    if (!is_new && place->second != name)
      throw BadInput("class {} is \"{}\" in one map and \"{}\" in the other", category,
                     place->second, name);
  }
  return names;
}

ClassRelations RelationsOfBoth(ClassRelations a, const ClassRelations& b) {
  a.whole_of.insert(b.whole_of.begin(), b.whole_of.end());
  a.movable.insert(b.movable.begin(), b.movable.end());
  if (const auto part = PartOfItself(a.whole_of))
    throw BadInput("class {} is a part of itself by what both maps say", *part);
  return a;
}

struct Placement {
  SearchResult search;
  std::optional<SubmapAlignment> alignment;
};

// The place of a submap in another map, from its keyframes that are found there.
Placement PlaceIn(const Submap& submap, const Map& world, RelocalizationMode mode,
                  const SlamConfig& config) {
  Relocalizer relocalizer(config);
  SubmapLink link;
  Placement placement;
  placement.search = FindKeyframes(submap, world, mode, kEffort, config, relocalizer, link);
  placement.alignment = link.Align(submap.map, submap.trajectory);
  return placement;
}

std::string EvidenceOf(const Placement& placement, const char* mapped, const char* in) {
  const SubmapAlignment& alignment = *placement.alignment;
  return fmt::format(
      "{} of {} keyframes of the {} map are found in the {} ({} by points and {} by objects agree, "
      "{} disagree; scale known to {:.1f} %)",
      placement.search.found, placement.search.looked_for, mapped, in, alignment.by_points,
      alignment.by_objects, alignment.contradicting, 100 * alignment.relative_sigma);
}

struct Relation {
  std::optional<Similarity> first_from_second;
  std::string evidence;
};

// Looks for the keyframes of the second submap in the first one, and if that fails the other way
// round.
Relation Relate(const Submap& first, const Submap& second, RelocalizationMode mode,
                const SlamConfig& config) {
  const Placement there = PlaceIn(second, first.map, mode, config);
  if (there.alignment)
    return {there.alignment->other_from_this, EvidenceOf(there, "second", "first")};
  const Placement here = PlaceIn(first, second.map, mode, config);
  if (here.alignment)
    return {here.alignment->other_from_this.Inverse(), EvidenceOf(here, "first", "second")};
  return {std::nullopt,
          fmt::format("{} of {} keyframes of the second map are found in the first, {} of {} of "
                      "the first in the second, and these do not agree on one transformation",
                      there.search.found, there.search.looked_for, here.search.found,
                      here.search.looked_for)};
}

// The trajectory of keyframes alone, where the map file has none of frames.
std::vector<FramePose> WithKeyframes(std::vector<FramePose> trajectory, const Map& map) {
  std::vector<FramePose> of_keyframes;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    of_keyframes.push_back(
        {keyframe.frame_index, keyframe.timestamp, id, {}, TrackingState::kTracking});
  });
  std::ranges::sort(of_keyframes, {}, &FramePose::frame_index);
  AdoptPoses(of_keyframes, 1, trajectory);
  return trajectory;
}

// The length of the path along keyframes.
double LengthOf(const Map& map, const std::vector<KeyframeId>& keyframes) {
  double length = 0;
  for (size_t i = 1; i < keyframes.size(); ++i)
    length += (map.keyframes.At(keyframes[i]).cam_from_world.OriginInSource() -
               map.keyframes.At(keyframes[i - 1]).cam_from_world.OriginInSource())
                  .norm();
  return length;
}

// Gives the merged map the unit of one of its maps. The optimisation fixes one keyframe only, so
// that the unit follows from the keyframes of that map before and after. Where that unit is known
// by objects, those of both maps tell it better.
void TakeUnitOf(const Map& metric, SavedMap& merged) {
  const std::vector<KeyframeId> keyframes = metric.keyframes.Ids();
  const double factor = LengthOf(metric, keyframes) / LengthOf(merged.map, keyframes);
  ScaleToMetres(factor, metric.unit_evidence, merged.map, merged.trajectory);
  if (!metric.unit_evidence || metric.unit_evidence->source != UnitSource::kObjects) return;
  const ScaleEstimate by_all = EstimateScale(merged.map, merged.class_names);
  if (by_all.success)
    ScaleToMetres(by_all.metres_per_unit,
                  UnitEvidence{by_all.relative_sigma, by_all.objects, by_all.classes}, merged.map,
                  merged.trajectory);
}

// How wrong the metre of a map may be.
double SigmaOfUnit(const Map& map) {
  if (!map.is_metric) return std::numeric_limits<double>::infinity();
  return map.unit_evidence ? map.unit_evidence->relative_sigma : 0;
}

}  // namespace

MapMerging MergeMaps(const SavedMap& a, const SavedMap& b, RelocalizationMode mode,
                     const SlamConfig& config) {
  const Renumbering numbers = NumbersBehind(a, b);
  SavedMap merged = a;
  ForgetScaleDrift(merged.map);
  merged.class_names = NamesOfBoth(a.class_names, b.class_names);
  const ClassRelations relations = RelationsOfBoth(a.map.classes, b.map.classes);
  for (MapRecording recording : b.recordings) {
    recording.first_frame += numbers.first_frame;
    merged.recordings.push_back(std::move(recording));
  }
  merged.map.cameras = numbers.cameras;
  for (Submap& submap : merged.submaps) submap.map.cameras = numbers.cameras;
  const Submap here{merged.map, WithKeyframes(a.trajectory, a.map)};
  const Submap joining = Renumbered({b.map, WithKeyframes(b.trajectory, b.map)}, numbers);

  const Relation relation = Relate(here, joining, mode, config);
  if (!relation.first_from_second) return {std::nullopt, relation.evidence};
  const Similarity& world_from_joining = *relation.first_from_second;

  Rng rng(static_cast<uint64_t>(config.runner.seed));
  merged.trajectory = here.trajectory;
  // Twelve ties, spread over the submap: with ties at one end only, errors would grow towards the
  // other.
  JoinSubmap(joining.map, world_from_joining, config, rng, merged.map,
             {.most = 12, .are_spread = true});
  AdoptPoses(joining.trajectory, world_from_joining.scale, merged.trajectory);
  SetClassRelations(relations, merged.map);
  OptimizeSubmap(config, merged.map);
  if (a.map.is_metric || b.map.is_metric)
    TakeUnitOf(SigmaOfUnit(a.map) <= SigmaOfUnit(b.map) ? here.map : joining.map, merged);
  for (const Submap& submap : b.submaps) merged.submaps.push_back(Renumbered(submap, numbers));
  for (Submap& submap : merged.submaps) SetClassRelations(relations, submap.map);
  std::ranges::stable_sort(merged.submaps, std::greater(),
                           [](const Submap& p) { return p.map.keyframes.size(); });
  return {std::move(merged), relation.evidence};
}

}  // namespace oaslam
