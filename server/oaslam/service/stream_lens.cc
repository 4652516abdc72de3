#include "oaslam/service/stream_lens.h"

#include <algorithm>
#include <cmath>

namespace oaslam {

bool StreamLens::IsOpen(double time_s) const {
  constexpr size_t kViews = 15;
  constexpr int kMostLooks = 30;
  constexpr double kApart = 1.5;  // s
  return !camera_ ||
         (seen_.size() < kViews && looks_ < kMostLooks && std::abs(time_s - last_s_) > kApart);
}

void StreamLens::Add(double time_s, const std::optional<Camera>& camera) {
  constexpr double kSame =
      0.003;  // share of the focal length: moves the edge by .15 % of the width
  looks_ += camera_.has_value();
  last_s_ = time_s;
  if (!camera) return;
  seen_.insert(std::ranges::upper_bound(seen_, camera->fx, {}, &Camera::fx), *camera);
  const Camera& median = seen_[(seen_.size() - 1) / 2];
  if (!camera_ || std::abs(median.fx / camera_->fx - 1) > kSame) camera_ = median;
}

}  // namespace oaslam
