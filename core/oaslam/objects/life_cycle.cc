#include "oaslam/objects/life_cycle.h"

#include <algorithm>

namespace oaslam {

bool IsForgotten(const Unseen& unseen) {
  // A slow video shows an object in few images within this time.
  constexpr double kDropAfter = 2;  // seconds
  constexpr int kFewImages = 5;
  return unseen.seconds > kDropAfter && unseen.images >= kFewImages;
}

Unseen UnseenSince(const Object& object, const ImageTime& now) {
  return {std::max(now.frame - object.last_seen_frame, 0),
          std::max(now.timestamp - object.last_seen_time.value_or(now.timestamp), 0.0)};
}

bool IsConfirmed(const ViewOverlap& overlap, const ObjectsConfig& config) {
  return overlap.accept_share >= config.min_accept_share && overlap.mean_iou >= kMinAcceptIoU;
}

bool IsContradicted(const ViewOverlap& overlap, const ObjectsConfig& config) {
  // Of objects.min_accept_share; lower, so that an object does not alternate between states.
  constexpr double kKeptShare = 0.6;
  return overlap.accept_share < kKeptShare * config.min_accept_share;
}

std::optional<ObjectState> NextState(ObjectState state, const ObjectEvidence& evidence,
                                     const ObjectsConfig& config) {
  if (state == ObjectState::kMapped) {
    const bool fails = !evidence.has_model || IsContradicted(evidence.overlap, config) ||
                       evidence.overlap.mean_iou < kMinAcceptIoU;
    return fails ? ObjectState::kInitialized : ObjectState::kMapped;
  }
  if (evidence.is_forgotten) return std::nullopt;
  if (!evidence.has_model) return ObjectState::kTentative;
  // One with a measured depth tells as much of the place as several from other sides.
  constexpr double kOfSurface = 4;
  const bool accepted =
      std::max(evidence.observations, kOfSurface * evidence.surfaces) >= config.min_observations &&
      IsConfirmed(evidence.overlap, config);
  return accepted ? ObjectState::kMapped : ObjectState::kInitialized;
}

}  // namespace oaslam
