#include "oaslam/matching/place_index.h"

#include <algorithm>
#include <iterator>
#include <ranges>
#include <utility>
#include <vector>

namespace oaslam {
namespace {

// The most descriptors indexed for one landmark: it looks different from different sides. In a
// large map, memory matters more than the last landmark found.
constexpr size_t kViewsOfALandmark = 4, kViewsInALargeMap = 2;
constexpr size_t kLargeMap = 200000;  // landmarks: with four views each, 25 MB of descriptors
// A quarter of the bits. Views from other sides differ by more than kTightHamming; what is wrong
// among the hits is found by geometry later.
constexpr int kMaxHamming = 64;
// A texture that repeats has more than a few similar landmarks, and tells no place.
constexpr size_t kMaxHits = 8;
// At most so many key points of an image vote, evenly chosen: they tell a place as well as all.
constexpr size_t kVoters = 600;
// Keyframes with most votes among which the places are chosen: far more than the places asked for.
constexpr size_t kRanked = 1000;
// Covisible keyframes that belong to a place besides its first: a pose needs landmarks all around.
constexpr int kNeighbours = 5;
// The weight of their votes: they support a place, but those of the first keyframe decide.
constexpr double kNeighbourVote = 0.2;

// The label of a point without a landmark is its keyframe's id with this bit.
constexpr uint32_t kOfKeyframe = 1U << 31;

DescriptorIndex IndexOfLearned(const Map& map) {
  std::vector<Descriptor> descriptors;
  std::vector<uint32_t> labels;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    const LearnedDescriptors& learned = keyframe.features->learned;
    for (size_t i = 0; i < learned.keypoints.size(); ++i) {
      const LandmarkId landmark = keyframe.landmarks[learned.keypoints[i]];
      if (!landmark.IsValid() && keyframe.learned_depths[i] == 0) continue;
      descriptors.push_back(learned.descriptors[i]);
      labels.push_back(landmark.IsValid() ? landmark.value : kOfKeyframe | id.value);
    }
  });
  return DescriptorIndex(std::move(descriptors), std::move(labels));
}

DescriptorIndex IndexOfOrb(const Map& map) {
  std::vector<Descriptor> descriptors;
  std::vector<uint32_t> labels;
  const size_t most = map.landmarks.size() < kLargeMap ? kViewsOfALandmark : kViewsInALargeMap;
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    const size_t seen = landmark.observations.size(), views = std::min(seen, most);
    for (size_t v = 0; v < views; ++v) {
      const Observation& o = landmark.observations[views == 1 ? 0 : v * (seen - 1) / (views - 1)];
      descriptors.push_back(map.keyframes.At(o.keyframe).features->descriptors[o.keypoint]);
      labels.push_back(id.value);
    }
  });
  return DescriptorIndex(std::move(descriptors), std::move(labels));
}

}  // namespace

PlaceIndex::PlaceIndex(const Map& map) : orb_(IndexOfOrb(map)), learned_(IndexOfLearned(map)) {}

LandmarkHits PlaceIndex::Find(const Features& features, Appearance appearance) const {
  const bool by_orb = appearance == Appearance::kOrb;
  const std::vector<Descriptor>& seen =
      by_orb ? features.descriptors : features.learned.descriptors;
  LandmarkHits hits;
  for (size_t i = 0; i < seen.size(); i += 1 + seen.size() / kVoters)
    hits.push_back((by_orb ? orb_ : learned_).Query(seen[i], kMaxHamming, kMaxHits));
  return hits;
}

Place PlaceAround(const Map& map, KeyframeId keyframe) {
  Place place{{keyframe}};
  std::ranges::copy(map.CovisibleKeyframes(keyframe, kNeighbours),
                    std::back_inserter(place.keyframes));
  return place;
}

std::vector<Place> PlaceIndex::RankPlaces(const Map& map, const LandmarkHits& hits,
                                          int count) const {
  // By keyframe. Most keyframes of a large map have a few votes by chance.
  std::vector<double> votes(map.keyframes.Bound().value, 0);
  for (const auto& of_keypoint : hits) {
    for (const DescriptorIndex::Hit& hit : of_keypoint) {
      const double vote = 1.0 / static_cast<double>(of_keypoint.size());
      if (hit.label & kOfKeyframe) {
        const KeyframeId keyframe(hit.label ^ kOfKeyframe);
        if (map.keyframes.Contains(keyframe)) votes[keyframe.value] += vote;
        continue;
      }
      const Landmark* landmark = map.landmarks.Find(LandmarkId(hit.label));
      if (!landmark) continue;
      for (const Observation& o : landmark->observations) votes[o.keyframe.value] += vote;
    }
  }
  std::vector<KeyframeId> voted;
  for (uint32_t k = 0; k < votes.size(); ++k)
    if (votes[k] > 0) voted.push_back(KeyframeId(k));
  const auto votes_of = [&](KeyframeId id) { return votes[id.value]; };
  if (voted.size() > kRanked) {
    std::ranges::nth_element(voted, voted.begin() + kRanked, std::ranges::greater{}, votes_of);
    voted.resize(kRanked);
    std::ranges::sort(voted);
  }
  std::vector<Place> places;
  for (const KeyframeId id : voted) {
    Place& place = places.emplace_back(PlaceAround(map, id));
    place.votes = votes_of(id);
    for (const KeyframeId neighbour : place.keyframes | std::views::drop(1))
      place.votes += kNeighbourVote * votes_of(neighbour);
  }
  std::ranges::stable_sort(places, std::ranges::greater{}, &Place::votes);
  std::vector<Place> chosen;
  for (Place& place : places) {
    if (static_cast<int>(chosen.size()) >= count) break;
    const bool covered = std::ranges::any_of(chosen, [&](const Place& better) {
      return std::ranges::find(better.keyframes, place.keyframes.front()) != better.keyframes.end();
    });
    if (!covered) chosen.push_back(std::move(place));
  }
  return chosen;
}

}  // namespace oaslam
