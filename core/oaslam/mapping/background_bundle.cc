#include "oaslam/mapping/background_bundle.h"

#include <utility>

namespace oaslam {

BackgroundBundle::BackgroundBundle(const Map& map, std::vector<KeyframeId> window,
                                   const BundleConfig& config, int frame_index,
                                   const WindowAdjustment& adjust)
    : begun_at_(frame_index), map_(map), window_(std::move(window)) {
  constexpr int kIterations = 20;  // at most; after a loop the start is far from the minimum
  correction_ = std::async(std::launch::async, [this, config, adjust] {
    return adjust(map_, window_, kIterations, config, stop_.get_token());
  });
}

void BackgroundBundle::WaitAndApply(Map& map) {
  const BundleCorrection& correction = correction_.get();
  if (!correction.success) return;
  ApplyLateCorrection(correction, map_, map);
  const bool is_whole = window_ == map_.keyframes.Ids();
  for (const KeyframeId id : is_whole ? map.keyframes.Ids() : window_)
    if (map.keyframes.Contains(id)) map.UpdateCovisibility(id);
}

}  // namespace oaslam
