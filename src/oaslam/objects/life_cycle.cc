#include "oaslam/objects/life_cycle.h"

namespace oaslam {

double MinKeptShare(const ObjectsConfig& config) { return 0.6 * config.min_accept_share; }

std::optional<ObjectState> NextState(ObjectState state, const ObjectEvidence& evidence, const ObjectsConfig& config) {
  if (state == ObjectState::kMapped) {
    const bool fails = !evidence.has_model || evidence.accept_share < MinKeptShare(config);
    return fails ? ObjectState::kInitialized : ObjectState::kMapped;
  }
  if (evidence.unseen_frames > config.drop_after) return std::nullopt;
  if (!evidence.has_model) return ObjectState::kTentative;
  const bool accepted =
      evidence.observations >= config.min_observations && evidence.accept_share >= config.min_accept_share;
  return accepted ? ObjectState::kMapped : ObjectState::kInitialized;
}

}  // namespace oaslam
