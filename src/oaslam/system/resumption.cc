#include "oaslam/system/resumption.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include "oaslam/estimation/similarity_fit.h"

namespace oaslam {
namespace {

constexpr int kMinAnchors = 20, kPointWeight = 2;  // a pose by points says more than one by objects
constexpr double kMinShare = 0.6;          // of the anchors that must agree
constexpr double kMaxScaleSigma = 0.06;    // relative
constexpr size_t kMinKeyframes = 5;

Map EmptyMapBehind(const Map& old) {
  Map empty;
  empty.cameras = old.cameras;
  empty.next_landmark = old.next_landmark;
  empty.classes = old.classes;
  return empty;
}

}  // namespace

Resumption::Resumption(const SlamConfig& config, const Map& old, const FirstIds& ids) : first_ids_(ids), session_(config, EmptyMapBehind(old), ids, false) {}

void Resumption::Process(const Frame& frame, const std::optional<PoseAnchor>& in_old) {
  const Tracker::Outcome outcome = session_.Process(frame);
  const bool is_lost = outcome.state == TrackingState::kLost || outcome.state == TrackingState::kObjects;
  if (!is_lost) lost_since_.reset();
  else if (!lost_since_) lost_since_ = frame.timestamp;
  if (in_old) anchors_.emplace(frame.index, *in_old);
}

void Resumption::AddDetections(int frame_index, const std::vector<ObjectDetection>& detections, const std::optional<PoseAnchor>& in_old) {
  session_.AddDetections(frame_index, detections);
  if (in_old) anchors_.emplace(frame_index, *in_old);
}

std::optional<Similarity> Resumption::Locate() const {
  const Map& map = *session_.snapshot();
  if (lost_since_ || map.keyframes.size() < kMinKeyframes) return std::nullopt;
  std::vector<PosePair> pairs;
  std::vector<int> weights;
  for (const FramePose& pose : session_.tracker().trajectory()) {
    const auto anchor = anchors_.find(pose.frame_index);
    const auto reference = map.ResolvePose(pose.reference);
    if (anchor == anchors_.end() || !reference || pose.state == TrackingState::kObjects) continue;
    pairs.push_back({pose.cam_from_reference * *reference, anchor->second.cam_from_world, anchor->second.sigma});
    weights.push_back(anchor->second.by_points ? kPointWeight : 1);
  }
  if (std::accumulate(weights.begin(), weights.end(), 0) < kMinAnchors) return std::nullopt;
  const SimilarityFit fit = FitSimilarity(pairs);
  if (!fit.success) return std::nullopt;
  int weight = 0;
  for (size_t i = 0; i < pairs.size(); ++i) weight += fit.is_inlier[i] ? weights[i] : 0;
  const bool agree = fit.inliers >= kMinShare * static_cast<double>(pairs.size()) && weight >= kMinAnchors;
  return agree && fit.relative_sigma < kMaxScaleSigma ? std::optional(fit.b_from_a) : std::nullopt;
}

}  // namespace oaslam
