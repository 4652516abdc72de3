#include "oaslam/tracking/initializer.h"

#include "oaslam/estimation/two_view.h"
#include "oaslam/matching/descriptor_match.h"

namespace oaslam {
namespace {

constexpr double kWindowPx = 100;
constexpr double kRatio = 0.9;

}  // namespace

void Initializer::Start(const Frame& frame) {
  first_.reset();
  between_.clear();
  if (frame.features->size() < config_.min_init_matches) return;
  first_ = frame;
  last_seen_.clear();
  for (const Keypoint& k : frame.features->keypoints) last_seen_.push_back(k.px.cast<double>());
}

std::optional<InitialMap> Initializer::Process(const Frame& frame, const Camera& camera, Rng& rng) {
  if (!first_) {
    Start(frame);
    return std::nullopt;
  }
  const KeypointPairs pairs = MatchWithinWindow(*first_->features, *frame.features, last_seen_, kWindowPx, kRatio);
  if (static_cast<int>(pairs.size()) < config_.min_init_matches) {
    Start(frame);
    return std::nullopt;
  }
  std::vector<Eigen::Vector2d> in_first, in_second;
  for (const auto& [a, b] : pairs) {
    in_first.push_back(first_->features->keypoints[a].px.cast<double>());
    in_second.push_back(frame.features->keypoints[b].px.cast<double>());
    last_seen_[a] = in_second.back();
  }
  TwoViewOptions options;
  options.min_parallax_deg = config_.min_init_parallax_deg;
  const TwoViewReport report = EstimateTwoView(camera, camera, in_first, in_second, options, rng);
  if (!report.success) {
    constexpr size_t kMaxBetween = 60;
    if (between_.size() < kMaxBetween) between_.push_back(frame);
    return std::nullopt;
  }
  InitialMap map{*first_, frame, {}, {}, report.second_from_first, {}};
  for (size_t i = 0; i < pairs.size(); ++i)
    if (report.points[i]) map.points.push_back({pairs[i].first, pairs[i].second, *report.points[i]});
  return map;
}

}  // namespace oaslam
