#include "oaslam/pieces/piece_link.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
#include <vector>

#include "oaslam/estimation/similarity_fit.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The assumed standard deviation of a position tracked by points, as a share of the depth, where
// landmarks are seen from near the places they were mapped from.
constexpr double kTrackedSigma = 0.005;

// Of frames that agree (WeightOf): ten by points, or four such keyframes.
constexpr int kMinWeight = 20;
constexpr double kMinShare = 0.6;  // of the frames that must agree: at a wrong place few do
// Relative; the ties and the adjustment after joining correct such an error.
constexpr double kMaxScaleSigma = 0.06;

// A pose by points is more accurate than one by objects.
int WeightOf(bool by_points, bool of_keyframe) {
  // The errors of keyframes are less correlated than those of successive frames.
  return of_keyframe ? (by_points ? 5 : 2) : (by_points ? 2 : 1);
}

double MedianDepth(const Map& map, const Relocalization& found) {
  std::vector<double> depths;
  for (const LandmarkId id : found.points.landmarks)
    if (const Landmark* landmark = id.IsValid() ? map.landmarks.Find(id) : nullptr)
      depths.push_back((found.cam_from_world * landmark->position).z());
  return depths.empty() ? 0 : Median(std::move(depths));
}

struct Passed {
  int frame_index = 0;
  double time = 0;
  Rigid3 cam_from_world;
  double depth = 0;  // median depth of the reference keyframe's landmarks
  bool is_other = false;
};

void Append(const Map& map, std::span<const FramePose> trajectory, const Similarity& world_from_map,
            bool is_other, std::vector<Passed>& way) {
  KeyframeId nearest;  // successive frames mostly have the same
  double depth = 0;
  for (const FramePose& frame : trajectory) {
    const auto reference = frame.state == TrackingState::kObjects
                               ? std::nullopt
                               : map.ResolveKeyframe(frame.reference);
    if (!reference) continue;
    if (reference->by != nearest) depth = map.MedianDepth(reference->by);
    nearest = reference->by;
    const Rigid3 cam_from_map = frame.cam_from_reference * reference->cam_from_carrier *
                                map.keyframes.At(reference->by).cam_from_world;
    way.push_back({frame.frame_index, frame.timestamp,
                   (Similarity(cam_from_map) * world_from_map.Inverse()).AsPose(),
                   world_from_map.scale * depth, is_other});
  }
}

struct Step {
  double seconds = 0, distance = 0, angle = 0;
};

Step StepBetween(const Passed& a, const Passed& b) {
  return {b.time - a.time,
          (a.cam_from_world.OriginInSource() - b.cam_from_world.OriginInSource()).norm(),
          a.cam_from_world.rotation.angularDistance(b.cam_from_world.rotation)};
}

double NinetyFifth(std::vector<double> values) {
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 95 / 100);
  std::ranges::nth_element(values, place);
  return *place;
}

}  // namespace

Relocalization TrackedAt(const Rigid3& cam_from_world, double depth) {
  Relocalization tracked;
  tracked.evidence = PoseEvidence::kPoints;
  tracked.cam_from_world = cam_from_world;
  const double sigma = kTrackedSigma * depth;
  tracked.covariance.diagonal().head<3>().setConstant(sigma * sigma / 3);
  return tracked;
}

void PieceLink::Add(int frame_index, const Relocalization& in_other) {
  located_.insert_or_assign(frame_index,
                            Located{in_other.cam_from_world, in_other.sigma_position(),
                                    in_other.evidence != PoseEvidence::kObjects, false});
}

void PieceLink::AddKeyframe(int frame_index, const Relocalization& found, const Map& other) {
  Add(frame_index, found);
  Located& located = located_.at(frame_index);
  located.of_keyframe = true;
  if (located.by_points)
    located.sigma = std::max(located.sigma, kTrackedSigma * MedianDepth(other, found));
}

std::optional<PieceAlignment> PieceLink::Align(const Map& map,
                                               std::span<const FramePose> trajectory) const {
  std::vector<PosePair> pairs;
  std::vector<Located> frames;
  int sum = 0;
  for (const FramePose& pose : trajectory | std::views::reverse) {
    const auto located = located_.find(pose.frame_index);
    const auto reference = located == located_.end() || pose.state == TrackingState::kObjects
                               ? std::nullopt
                               : map.ResolvePose(pose.reference);
    if (!reference) continue;
    const Located& frame = frames.emplace_back(located->second);
    pairs.push_back({pose.cam_from_reference * *reference, frame.cam_from_other, frame.sigma});
    sum += WeightOf(frame.by_points, frame.of_keyframe);
  }
  if (sum < kMinWeight) return std::nullopt;
  const SimilarityFit fit = FitSimilarity(pairs);
  if (!fit.success) return std::nullopt;
  PieceAlignment alignment{.other_from_this = fit.b_from_a, .relative_sigma = fit.relative_sigma};
  int weight = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (fit.is_inlier[i]) weight += WeightOf(frames[i].by_points, frames[i].of_keyframe);
    ++(!fit.is_inlier[i]     ? alignment.contradicting
       : frames[i].by_points ? alignment.by_points
                             : alignment.by_objects);
  }
  const bool agree = alignment.ShareAgreeing() >= kMinShare && weight >= kMinWeight;
  return agree && fit.relative_sigma < kMaxScaleSigma ? std::optional(alignment) : std::nullopt;
}

std::span<const FramePose> NewestPoses(const std::vector<FramePose>& trajectory, double now) {
  constexpr double kSeconds = 60;
  auto first = trajectory.end();
  while (first != trajectory.begin() && std::prev(first)->timestamp >= now - kSeconds) --first;
  return {first, trajectory.end()};
}

bool IsContinuous(const Map& map, std::span<const FramePose> trajectory, const Map& other,
                  std::span<const FramePose> other_trajectory, const Similarity& world_from_other) {
  // Longer steps are between two videos, or after a pause, and tell nothing of speed.
  constexpr double kMaxSeconds = 3;
  constexpr double kMaxTimes = 2;  // faster than within the pieces
  constexpr double kHandTurn = 3,
                   kHandSpeed = 1;  // that a hand is always capable of: rad/s, depths/s
  const auto is_step = [](const Step& step) {
    return step.seconds > 0 && step.seconds <= kMaxSeconds;
  };
  // The error of the alignment of the pieces, as a share of the depth and in rad.
  constexpr double kTolerance = 0.03;
  std::vector<Passed> way;
  Append(map, trajectory, Similarity(), false, way);
  Append(other, other_trajectory, world_from_other, true, way);
  // Of frames that both pieces have, the pose in `map` is kept: the sort is
  // stable and it comes first.
  std::ranges::stable_sort(way, {}, &Passed::frame_index);
  const auto doubled = std::ranges::unique(way, {}, &Passed::frame_index);
  way.erase(doubled.begin(), doubled.end());
  std::vector<double> speeds, turns;
  for (size_t i = 1; i < way.size(); ++i) {
    const Step step = StepBetween(way[i - 1], way[i]);
    if (way[i - 1].is_other != way[i].is_other || !is_step(step)) continue;
    speeds.push_back(step.distance / step.seconds);
    turns.push_back(step.angle / step.seconds);
  }
  if (speeds.empty()) return true;
  const double max_speed = kMaxTimes * NinetyFifth(std::move(speeds)),
               max_turn = std::max(kHandTurn, kMaxTimes * NinetyFifth(std::move(turns)));
  for (size_t i = 1; i < way.size(); ++i) {
    const Step step = StepBetween(way[i - 1], way[i]);
    if (way[i - 1].is_other == way[i].is_other || !is_step(step)) continue;
    const double depth = std::min(way[i - 1].depth, way[i].depth);
    const double max_distance =
        std::max(max_speed, kHandSpeed * depth) * step.seconds + kTolerance * depth;
    if (step.distance > max_distance || step.angle > max_turn * step.seconds + kTolerance)
      return false;
  }
  return true;
}

}  // namespace oaslam
