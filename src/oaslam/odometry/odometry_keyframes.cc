// Which images the odometry keeps, and which points it follows from them.
#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "oaslam/odometry/odometry.h"
#include "oaslam/util/median.h"

namespace oaslam {

bool Odometry::NeedsKeyframe(const OdometryEstimate& estimate) const {
  constexpr double kFlow =
      0.04;  // of the width, the median since the keyframe: new depths are known
  constexpr double kSeenAgain = 0.7;  // share of the keyframe's points: others are in view by now
  constexpr int kLeastTracked = 20;
  std::vector<double> flow;
  int seen = 0;
  for (const WindowPoint& p : window_.points) {
    const Eigen::Vector2f* before = p.PxIn(keyframe_id_);
    if (!before) continue;
    ++seen;
    if (!p.sightings.empty() && p.sightings.back().image == window_.newest().id)
      flow.push_back((p.px - *before).norm());
  }
  return keyframe_is_due_ || estimate.tracked < kLeastTracked ||
         static_cast<double>(flow.size()) < kSeenAgain * seen ||
         (!flow.empty() && Median(flow) > kFlow * camera_.width);
}

void Odometry::MakeKeyframe() {
  keyframe_is_due_ = false;
  window_.newest().is_keyframe = true;
  keyframe_id_ = window_.newest().id;
  int free = 0;
  for (const WindowImage& image : window_.images) free += image.is_keyframe && !image.is_held;
  if (is_beginning_) {
    if (free + 1 > options_.max_beginning) DropFirst();
  } else {
    for (WindowImage& image : window_.images) {
      if (free <= options_.window) break;
      if (!image.is_keyframe || image.is_held) continue;
      image.is_held = true;
      --free;
    }
  }
  AddPoints();
}

void Odometry::AddPoints() {
  const WindowImage& newest = window_.newest();
  std::vector<Eigen::Vector2f> tracked;
  std::vector<std::pair<Eigen::Vector2f, double>> depths;  // inverse, of those that are known
  for (const WindowPoint& p : window_.points) {
    if (!p.is_tracked) continue;
    tracked.push_back(p.px);
    if (p.HasDepth()) depths.emplace_back(p.px, window_.InverseDepthIn(p, newest));
  }
  const double median = window_.median_inverse_depth;
  for (const Eigen::Vector2f& px : FindCorners(present_->level(0), tracked, options_.grid)) {
    if (IsHidden(px)) continue;
    WindowPoint point{newest.id, px, RayAt(px)};
    point.px = px;
    point.inverse_depth = median;
    if (depths.size() >= 3) {
      std::array<std::pair<float, double>, 3> nearest;
      nearest.fill({std::numeric_limits<float>::infinity(), median});
      for (const auto& [at, depth] : depths) {
        const std::pair<float, double> here{(at - px).squaredNorm(), depth};
        if (here.first >= nearest.back().first) continue;
        nearest.back() = here;
        std::ranges::sort(nearest);
      }
      std::ranges::sort(nearest, {}, &std::pair<float, double>::second);
      point.inverse_depth = std::max(0.05 * median, nearest[1].second);
    }
    point.prior_inverse_depth = point.inverse_depth;
    point.prior_sigma = std::max(point.inverse_depth, median);
    point.variance = point.prior_sigma * point.prior_sigma;
    window_.points.push_back(std::move(point));
  }
}

void Odometry::Forget() {
  std::vector<int> recent;
  for (const WindowImage& image : window_.images)
    if (!image.is_keyframe) recent.push_back(image.id);
  for (size_t i = 0; i + options_.recent < recent.size(); ++i) window_.Remove(recent[i]);
  window_.RemoveUnused(window_.newest().id);
}

}  // namespace oaslam
