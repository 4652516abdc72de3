#include "oaslam/tracking/lost_camera.h"

#include <cmath>
#include <utility>

namespace oaslam {

LostCamera::LostCamera(const SlamConfig& config)
    : relocalizer_(config), rng_(static_cast<uint64_t>(config.runner.seed)) {}

Relocalization LostCamera::Find(const Frame& frame, const Map& map, const TrackingContext& context,
                                const std::optional<Rigid3>& prior) {
  return relocalizer_.Find(frame, map, context.search, rng_,
                           context.IsMapping() ? nullptr : &trails_, prior);
}

Relocalization LostCamera::FindAlone(const Frame& frame, const Map& map,
                                     RelocalizationMode search) {
  return relocalizer_.Find(frame, map, search, rng_);
}

bool LostCamera::IsTimeToLook(double timestamp) {
  constexpr double kSeconds = 0.2;
  if (std::abs(timestamp - looked_at_) < kSeconds) return false;
  looked_at_ = timestamp;
  return true;
}

void LostCamera::Keep(const Frame& frame) {
  constexpr size_t kMost = 450;  // 15 s at 30 Hz; the odometry drifts
  const bool is_new = images_.empty() || images_.back().frame_index < frame.index;
  if (frame.motion && is_new) images_.push_back({frame.index, frame.timestamp, frame.motion});
  if (images_.size() > kMost) images_.erase(images_.begin());
}

std::vector<LostCamera::Image> LostCamera::TakeImages() { return std::exchange(images_, {}); }

void LostCamera::Forget() {
  trails_ = {};
  registration_ = {};
}

}  // namespace oaslam
