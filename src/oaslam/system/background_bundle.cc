#include "oaslam/system/background_bundle.h"

#include <utility>

namespace oaslam {

BackgroundBundle::BackgroundBundle(const Map& map, std::vector<KeyframeId> window,
                                   const BundleConfig& config, int frame_index,
                                   const WindowAdjustment& adjust)
    : begun_at_(frame_index), work_(new Work{map, std::move(window), {}, nullptr, false}) {
  constexpr int kIterations = 20;  // at most; after a loop the start is far from the minimum
  thread_ = std::jthread([work = work_.get(), config, adjust](const std::stop_token& stop) {
    try {
      work->correction = adjust(work->map, work->window, kIterations, config, stop);
    } catch (...) {
      work->failure = std::current_exception();
    }
    work->is_ready = true;
  });
}

void BackgroundBundle::WaitAndApply(int min_shared_landmarks, Map& map) {
  if (thread_.joinable()) thread_.join();
  if (work_->failure) std::rethrow_exception(work_->failure);
  if (!work_->correction.success) return;
  ApplyLateCorrection(work_->correction, work_->map, map);
  const bool is_whole = work_->window == work_->map.keyframes.Ids();
  for (const KeyframeId id : is_whole ? map.keyframes.Ids() : work_->window)
    if (map.keyframes.Contains(id)) map.UpdateCovisibility(id, min_shared_landmarks);
}

}  // namespace oaslam
