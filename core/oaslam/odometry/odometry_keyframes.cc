// Which images the odometry keeps, and which points it follows from them.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "oaslam/odometry/odometry.h"
#include "oaslam/odometry/patch_edge.h"
#include "oaslam/odometry/patch_fit.h"
#include "oaslam/odometry/point_flow.h"
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

// How a patch that faces the camera was stretched since an image, by its depth and the rotation.
Eigen::Matrix2f Odometry::StretchSince(int image, const WindowPoint& point) const {
  if (!window_.Has(image)) return Eigen::Matrix2f::Identity();
  const WindowImage &before = window_.Image(image), &newest = window_.newest();
  const double there = window_.InverseDepthIn(point, before),
               here = window_.InverseDepthIn(point, newest);
  const double size = there > 0 && here > 0 ? std::clamp(here / there, 0.5, 2.0) : 1;
  const Eigen::Matrix3d rotation =
      (newest.cam_from_odom.rotation * before.cam_from_odom.rotation.conjugate())
          .toRotationMatrix();
  return (size * rotation.topLeftCorner<2, 2>()).cast<float>();
}

// Fits the followed points' patches to where they were seen first, so that what a keyframe keeps is
// right to a fraction of a pixel; how many are still followed. What no longer looks alike (an edge
// before a wall, a reflection) is no point of the scene; where that is much of the image, the image
// is blurred, and all stay.
int Odometry::FitPatches() {
  constexpr double kAlike = 0.8, kBlurred = 0.2;  // a share of the points
  int followed = 0;
  std::vector<WindowPoint*> unlike;
  for (WindowPoint& p : window_.points) {
    if (!p.is_tracked) continue;
    ++followed;
    const KeptKeyframe* earlier = EarliestView(p);
    if (!earlier) continue;
    if (p.stretched_from != earlier->id) p.stretch = StretchSince(earlier->id, p);
    p.stretched_from = earlier->id;
    const auto fit = FitPatch(earlier->pyramid->level(0), *p.PxIn(earlier->id), present_->level(0),
                              {p.px, p.stretch});
    if (!fit) continue;
    if (fit->correlation < kAlike) {
      unlike.push_back(&p);
      continue;
    }
    if ((fit->pose.px - p.px).norm() > kMaxShift) continue;
    p.px = fit->pose.px;
    p.stretch = fit->pose.stretch;
    p.sightings.back().px = p.px;
    p.sightings.back().ray = RayAt(p.px);
  }
  if (static_cast<double>(unlike.size()) > kBlurred * followed) return followed;
  for (WindowPoint* p : unlike) {
    p->is_tracked = false;
    p->sightings.pop_back();
  }
  return followed - static_cast<int>(unlike.size());
}

// How this film's camera turns: the median change of its rate, of keyframes that are settled.
void Odometry::LearnTurns() {
  constexpr size_t kSettled = 4;  // keyframes came after it
  constexpr double kMostSeconds = 0.5;
  constexpr double kStep = 0.03;  // of the median, each time
  // Of the median's length, which is one and a half sigmas of a Gaussian's axis: a camera that
  // stops or swings changes its turn by far more than mostly. With a half flats have wrong motions
  // again.
  constexpr double kOfMedian = 1.7;
  std::vector<const WindowImage*> known;
  for (const WindowImage& image : window_.images)
    if (image.is_keyframe) known.push_back(&image);
  if (known.size() < kSettled + 3) return;
  const WindowImage* const* last = &known[known.size() - kSettled - 1];
  const double first = last[-1]->time_s - last[-2]->time_s,
               second = last[0]->time_s - last[-1]->time_s;
  if (std::max(first, second) > kMostSeconds) return;
  const auto rate = [](const WindowImage& from, const WindowImage& to, double seconds) {
    const Eigen::AngleAxisd turn(
        Eigen::Quaterniond(to.cam_from_odom.rotation * from.cam_from_odom.rotation.conjugate()));
    return Eigen::Vector3d(turn.angle() / seconds * turn.axis());
  };
  const double change =
      (rate(*last[-1], *last[0], second) - rate(*last[-2], *last[-1], first)).norm() /
      std::sqrt(0.5 * (first + second));
  double& sigma = window_options_.turn_rate_sigma;
  sigma *= std::exp(kOfMedian * change > sigma ? kStep : -kStep);
}

void Odometry::MakeKeyframe() {
  keyframe_is_due_ = false;
  window_.newest().is_keyframe = true;
  if (!is_beginning_) LearnTurns();
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
      imu_.LearnFromHeld(image, window_options_, window_);
      --free;
    }
  }
  if (!is_beginning_) {
    imu_.Align(window_options_, window_);
    depth_.LearnMetre(window_);
    depth_.Judge(window_options_, solver_, window_);
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
  const std::vector<Eigen::Vector2f> corners =
      FindCorners(present_->level(0), tracked, options_.grid);
  for (const Eigen::Vector2f& px : corners)
    if (const auto measured = depth_.At(px)) depths.emplace_back(px, measured->value);
  const double median = window_.median_inverse_depth;
  for (const Eigen::Vector2f& px : corners) {
    if (IsHidden(px)) continue;
    WindowPoint point{newest.id, px, RayAt(px)};
    point.px = px;
    point.edge = EdgeAt(present_->level(0), px);
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
    if (const auto measured = depth_.At(px)) {
      point.SetMeasured(*measured);
      point.inverse_depth = measured->value;
    }
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
