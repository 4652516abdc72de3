#include "oaslam/objects/own_landmarks.h"

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

std::vector<Eigen::Vector3d> PositionsOf(const Map& map, std::span<const LandmarkId> landmarks) {
  std::vector<Eigen::Vector3d> positions;
  for (const LandmarkId id : landmarks)
    if (const Landmark* landmark = map.landmarks.Find(id)) positions.push_back(landmark->position);
  return positions;
}

}  // namespace

void AddVotes(const std::vector<LandmarkId>& landmarks, const std::vector<uint16_t>& votes,
              Object& object) {
  std::vector<LandmarkId> ids;
  std::vector<uint16_t> sums;
  size_t i = 0, j = 0;
  while (i < object.landmarks.size() || j < landmarks.size()) {
    const bool take_own = j >= landmarks.size() ||
                          (i < object.landmarks.size() && object.landmarks[i] <= landmarks[j]);
    const LandmarkId id = take_own ? object.landmarks[i] : landmarks[j];
    int sum = 0;
    while (i < object.landmarks.size() && object.landmarks[i] == id)
      sum += object.landmark_votes[i++];
    while (j < landmarks.size() && landmarks[j] == id) sum += votes[j++];
    ids.push_back(id);
    sums.push_back(static_cast<uint16_t>(std::min(sum, UINT16_MAX + 0)));
  }
  object.landmarks = std::move(ids);
  object.landmark_votes = std::move(sums);
}

std::vector<LandmarkId> VotedLandmarks(const Object& object, int votes) {
  constexpr int kMinVotes = 3;  // with fewer, landmarks behind an object count, too
  std::vector<LandmarkId> voted;
  for (size_t i = 0; i < object.landmarks.size(); ++i)
    if (object.landmark_votes[i] >= std::max(votes, kMinVotes))
      voted.push_back(object.landmarks[i]);
  return voted;
}

std::vector<LandmarkId> OwnLandmarks(const Object& object) {
  constexpr int kVoteDivisor = 3;  // as in the header
  if (object.landmark_votes.empty()) return {};
  return VotedLandmarks(object, *std::ranges::max_element(object.landmark_votes) / kVoteDivisor);
}

int CountShared(std::span<const LandmarkId> a, std::span<const LandmarkId> b) {
  int shared = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (*i == *j) ++shared;
    if (*i <= *j)
      ++i;
    else
      ++j;
  }
  return shared;
}

bool IsKnownByLandmarks(const Map& map, const ObjectsConfig& config, const Object& object) {
  if (object.state == ObjectState::kMapped || config.model == ObjectMethod::kPaper) return false;
  return std::ssize(PositionsOf(map, OwnLandmarks(object))) >= kMinSharedPoints;
}

void RecognizeByLandmarks(const Map& map, const ObjectsConfig& config, Object& object) {
  object.known_by_landmarks = IsKnownByLandmarks(map, config, object);
  if (!object.known_by_landmarks || object.state != ObjectState::kTentative) return;
  std::vector<Eigen::Vector3d> positions = PositionsOf(map, OwnLandmarks(object));
  // The median of each coordinate, since some landmarks in its boxes are on the wall behind it.
  const auto middle = static_cast<std::ptrdiff_t>(positions.size() / 2);
  Eigen::Vector3d center, spread;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto median = [&](auto&& value_of) {
      std::ranges::nth_element(positions, positions.begin() + middle, {}, value_of);
      return value_of(positions[static_cast<size_t>(middle)]);
    };
    center[axis] = median([&](const Eigen::Vector3d& p) { return p[axis]; });
    spread[axis] =
        median([&](const Eigen::Vector3d& p) { return std::abs(p[axis] - center[axis]); });
  }
  object.ellipsoid = {center, Eigen::Vector3d::Constant(spread.norm()),
                      Eigen::Quaterniond::Identity()};
}

}  // namespace oaslam
