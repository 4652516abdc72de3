#include "oaslam/system/submap_link.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <ranges>
#include <vector>

#include "oaslam/estimation/similarity_fit.h"
#include "oaslam/tracking/image_pose.h"

namespace oaslam {
namespace {

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

}  // namespace

void SubmapLink::Add(int frame_index, const Relocalization& in_other) {
  located_.insert_or_assign(frame_index,
                            Located{in_other.cam_from_world, in_other.sigma_position(),
                                    in_other.evidence != PoseEvidence::kObjects, false});
}

void SubmapLink::AddKeyframe(int frame_index, const Relocalization& found, const Map& other) {
  Add(frame_index, found);
  Located& located = located_.at(frame_index);
  located.of_keyframe = true;
  if (located.by_points)
    located.sigma =
        std::max(located.sigma,
                 kTrackedSigma * other.MedianDepth(found.cam_from_world, found.points.landmarks));
}

std::optional<SubmapAlignment> SubmapLink::Align(const Map& map,
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
  SubmapAlignment alignment{.other_from_this = fit.b_from_a, .relative_sigma = fit.relative_sigma};
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

}  // namespace oaslam
