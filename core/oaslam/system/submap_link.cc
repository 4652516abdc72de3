#include "oaslam/system/submap_link.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <vector>

#include "oaslam/estimation/similarity_fit.h"
#include "oaslam/tracking/image_pose.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Of frames that agree (WeightOf): ten by points, or four such keyframes, or two that tell the
// scale, too.
constexpr int kMinWeight = 20;
constexpr double kMinShare = 0.6;      // of the frames that must agree: at a wrong place few do
constexpr double kCommonSigma = 0.01;  // what all depths of a map are off by together; a guess
// Relative; the ties and the adjustment after joining correct such an error.
constexpr double kMaxScaleSigma = 0.06;

// A pose by points is more accurate than one by objects.
int WeightOf(bool by_points, bool of_keyframe, bool tells_scale) {
  if (tells_scale) return 10;
  // The errors of keyframes are less correlated than those of successive frames.
  return of_keyframe ? (by_points ? 5 : 2) : (by_points ? 2 : 1);
}

}  // namespace

void SubmapLink::Add(int frame_index, const Relocalization& in_other) {
  located_.insert_or_assign(frame_index,
                            Located{in_other.cam_from_world, in_other.sigma_position(),
                                    in_other.evidence != PoseEvidence::kObjects, false});
}

void SubmapLink::AddKeyframe(int frame_index, const Relocalization& found, const Map& other,
                             bool is_soon) {
  Add(frame_index, found);
  Located& located = located_.at(frame_index);
  located.of_keyframe = true;
  if (!located.by_points) return;
  located.sigma =
      std::max(located.sigma,
               kTrackedSigma * other.MedianDepth(found.cam_from_world, found.points.landmarks));
  if (!is_soon) return;
  for (int k = 0; k < static_cast<int>(found.points.landmarks.size()); ++k)
    if (const Landmark* landmark = other.landmarks.Find(found.points.landmarks[k]))
      located.depths.push_back({k, (found.cam_from_world * landmark->position).z()});
}

// The scale by the depths of key points that have a landmark in both submaps: it needs no motion of
// the camera. Nothing where they are few.
std::optional<ScalePrior> SubmapLink::ScaleByPoints(const Keyframe& keyframe, const Map& map,
                                                    std::span<const PointDepth> depths) {
  constexpr size_t kLeast = 15;
  constexpr double kLeastSigma = 0.02;  // depths of a keyframe that few views tell; a guess
  // Of normal errors: the sigma of a median over that of a mean; sigma over median deviation.
  constexpr double kOfMedian = 1.25, kOfDeviation = 1.48;
  std::vector<double> ratios;
  for (const PointDepth& point : depths)
    if (point.keypoint < static_cast<int>(keyframe.landmarks.size()))
      if (const Landmark* own = map.landmarks.Find(keyframe.landmarks[point.keypoint]))
        if (const double depth = (keyframe.cam_from_world * own->position).z();
            depth > 0 && point.depth > 0)
          ratios.push_back(std::log(point.depth / depth));
  if (ratios.size() < kLeast) return std::nullopt;
  const double middle = Median(ratios), count = static_cast<double>(ratios.size());
  for (double& ratio : ratios) ratio = std::abs(ratio - middle);
  return ScalePrior{
      std::exp(middle),
      kLeastSigma + kOfMedian * kOfDeviation * Median(std::move(ratios)) / std::sqrt(count)};
}

std::optional<SubmapAlignment> SubmapLink::Align(const Map& map,
                                                 std::span<const FramePose> trajectory) const {
  std::vector<PosePair> pairs;
  std::vector<const Located*> frames;
  int sum = 0;
  for (const FramePose& pose : trajectory | std::views::reverse) {
    const auto located = located_.find(pose.frame_index);
    const auto reference = located == located_.end() || pose.state == TrackingState::kObjects
                               ? std::nullopt
                               : map.ResolvePose(pose.reference);
    if (!reference) continue;
    const Located& frame = *frames.emplace_back(&located->second);
    PosePair& pair = pairs.emplace_back(
        PosePair{pose.cam_from_reference * *reference, frame.cam_from_other, frame.sigma});
    const Keyframe* keyframe = map.keyframes.Find(pose.reference);
    if (keyframe && keyframe->frame_index == pose.frame_index)
      pair.scale = ScaleByPoints(*keyframe, map, frame.depths);
    sum += WeightOf(frame.by_points, frame.of_keyframe, pair.scale.has_value());
  }
  if (sum < kMinWeight) return std::nullopt;
  const SimilarityFit fit = FitSimilarity(pairs);
  if (!fit.success) return std::nullopt;
  SubmapAlignment alignment{.other_from_this = fit.b_from_a, .relative_sigma = fit.relative_sigma};
  int weight = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (fit.is_inlier[i])
      weight += WeightOf(frames[i]->by_points, frames[i]->of_keyframe, pairs[i].scale.has_value());
    ++(!fit.is_inlier[i]      ? alignment.contradicting
       : frames[i]->by_points ? alignment.by_points
                              : alignment.by_objects);
  }
  alignment.relative_sigma = std::hypot(fit.relative_sigma, kCommonSigma);
  // Where a third one contradicts, two may be the ones that are wrong.
  constexpr int kWithContradiction = 3;
  const bool is_doubtful = alignment.contradicting > 0 &&
                           alignment.by_points + alignment.by_objects < kWithContradiction;
  const bool agree = alignment.ShareAgreeing() >= kMinShare && weight >= kMinWeight && !is_doubtful;
  return agree && alignment.relative_sigma < kMaxScaleSigma ? std::optional(alignment)
                                                            : std::nullopt;
}

}  // namespace oaslam
