// What a depth camera tells the odometry.
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "oaslam/odometry/odometry.h"
#include "oaslam/util/log.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Of points that are followed: so many determine a pose as well as those of a beginning by images.
constexpr int kLeastDepths = 60;

}  // namespace

void Odometry::TakeDepth(double time_s, const std::shared_ptr<const DepthMap>& depth) {
  depth_ = depth_is_refused_ ? nullptr : depth;
  RememberDepth(time_s);
  // Depths that came late: what the images have told so far is without a metre, and preliminary.
  if (!depth_ || !is_beginning_ || window_.images.empty()) return;
  const auto is_seen = [&](const WindowPoint& p) { return p.is_tracked && DepthAt(p.px); };
  if (2 * std::ranges::count_if(window_.points, is_seen) > 3 * kLeastDepths) BeginAnew();
}

std::optional<MeasuredDepth> Odometry::DepthAt(const Eigen::Vector2f& px) const {
  return depth_ ? depth_->At(std::ldexp(1, halvings_) * px.cast<double>()) : std::nullopt;
}

// The inverse depth that was measured there, and its standard deviation, by units; nothing while
// the length of a metre is not known.
std::optional<MeasuredInverseDepth> Odometry::MeasuredAt(const Eigen::Vector2f& px) const {
  if (!(units_per_metre_ > 0)) return std::nullopt;
  const std::optional<MeasuredDepth> depth = DepthAt(px);
  if (!depth) return std::nullopt;
  const double value = 1 / (depth->z * units_per_metre_);
  return MeasuredInverseDepth{value, value * depth->sigma / depth->z};
}

void Odometry::MeasureSightings() {
  if (!depth_) return;
  for (WindowPoint& p : window_.points)
    if (!p.sightings.empty() && p.sightings.back().image == window_.newest().id)
      p.sightings.back().measured = MeasuredAt(p.px);
}

// Adds the first points. Where enough of them have a depth, the motion needs no beginning.
void Odometry::AddFirstPoints() {
  units_per_metre_ = depth_ ? 1 : 0;
  AddPoints();
  if (!depth_) return;
  if (std::ranges::count_if(window_.points, &WindowPoint::is_measured) >= kLeastDepths) {
    is_beginning_ = false;
    UpdateMedianDepth(false, window_);
    return;
  }
  units_per_metre_ = 0;
  window_.points.clear();
  AddPoints();
}

// Of a run that began without depths: the length of a metre, once points have both a depth that was
// measured and one by their parallax.
void Odometry::LearnMetre() {
  constexpr double kMostSpread = 0.1;  // half of the ratios are within
  if (!depth_ || is_beginning_ || units_per_metre_ > 0) return;
  std::vector<double> ratios;
  for (const WindowPoint& p : window_.points) {
    if (!p.is_tracked || !p.HasGoodDepth()) continue;
    const auto depth = DepthAt(p.px);
    const double inverse = window_.InverseDepthIn(p, window_.newest());
    if (depth && inverse > 0) ratios.push_back(1 / (inverse * depth->z));
  }
  if (std::ssize(ratios) < kLeastDepths) return;
  const double median = Median(ratios);
  for (double& ratio : ratios) ratio = std::abs(ratio / median - 1);
  if (Median(std::move(ratios)) < kMostSpread) units_per_metre_ = median;
}

// Compares the depth of a point, which was just optimised, with what its parallax alone says; a
// measurement that contradicts it is of another surface, and is not used.
void Odometry::CompareDepth(WindowPoint& point) {
  constexpr double kKnown = 0.05, kMostOff = 4;  // by the parallax, a share; sigmas
  if (!point.is_measured) return;
  const DepthPrior prior{0, point.ray, point.prior_inverse_depth, point.prior_sigma, true};
  const double prior_variance = point.prior_sigma * point.prior_sigma,
               prior_information = WeightOf(prior, point.inverse_depth) / prior_variance,
               by_parallax = 1 / point.variance - prior_information;
  if (!(by_parallax * std::pow(kKnown * point.prior_inverse_depth, 2) > 1)) return;
  const double inverse_depth =
      (point.inverse_depth / point.variance - point.prior_inverse_depth * prior_information) /
      by_parallax;
  const double off = std::abs(inverse_depth - point.prior_inverse_depth) /
                     std::sqrt(1 / by_parallax + prior_variance);
  if (!(off > kMostOff)) return;
  point.is_measured = false;
  point.inverse_depth = point.prior_inverse_depth = inverse_depth;
  point.prior_sigma = std::max(std::abs(inverse_depth), window_.median_inverse_depth);
  point.variance = 1 / by_parallax;
}

// The window by its images alone: only its first pose is held, and the farthest one keeps its
// distance.
Window Odometry::WithoutDepths() const {
  Window free = window_;
  free.inertial.reset();
  const auto way = [&](const WindowImage& image) {
    return (image.cam_from_odom.OriginInSource() -
            free.images.front().cam_from_odom.OriginInSource())
        .norm();
  };
  const auto farthest = std::ranges::max_element(free.images, {}, way);
  free.unit = UnitLength{free.images.front().id, farthest->id, way(*farthest)};
  for (WindowImage& image : free.images) image.is_held = image.id == free.images.front().id;
  constexpr double kUnknown = 5;  // median depths
  for (WindowPoint& p : free.points)
    if (std::exchange(p.is_measured, false)) p.prior_sigma = kUnknown * free.median_inverse_depth;
  return free;
}

// Keeps depths that will be judged soon.
void Odometry::RememberDepth(double time_s) {
  constexpr double kSeconds = 1;  // bounds the memory
  std::erase_if(recent_depths_, [&](const auto& d) { return d.first < time_s - kSeconds; });
  if (depth_ && depth_trust_.IsDue(time_s + kSeconds)) recent_depths_[time_s] = depth_;
}

// The depths that came nearest to this time; null where none came within a hundredth of a second.
const DepthMap* Odometry::DepthNear(double time_s) const {
  constexpr double kTolerance = 0.012;
  const auto after = recent_depths_.lower_bound(time_s);
  const DepthMap* nearest = nullptr;
  double least = kTolerance;
  const auto try_one = [&](const auto& at) {
    if (std::abs(at->first - time_s) >= least) return;
    least = std::abs(at->first - time_s);
    nearest = at->second.get();
  };
  if (after != recent_depths_.end()) try_one(after);
  if (after != recent_depths_.begin()) try_one(std::prev(after));
  return nearest;
}

// What the depths of an image say of its points, by each reading, besides what the images tell.
std::array<DepthTrust::Views, DepthTrust::kReadings.size()> Odometry::ViewDepths(
    const Window& free, std::span<const int> points, std::span<const double> variances,
    const WindowImage& image) const {
  constexpr double kKnown = 0.05;  // by the images, a share
  // Noise counts less in a logarithm to which much was added: points are this far, in offsets.
  constexpr double kOffsets = 4;
  const DepthMap* given = DepthNear(image.time_s);
  const double working = std::ldexp(1, halvings_);
  const Eigen::Vector2d center(camera_.cx, camera_.cy);
  std::array<DepthTrust::Views, DepthTrust::kReadings.size()> views;
  for (size_t i = 0; i < views.size(); ++i) {
    const auto& [zoom, offset, delay] = DepthTrust::kReadings[i];
    const DepthMap* map = DepthNear(image.time_s + delay);
    if (!given || !map) continue;
    for (size_t k = 0; k < points.size(); ++k) {
      const WindowPoint& p = free.points[points[k]];
      const Eigen::Vector2f* px = p.PxIn(image.id);
      const double sigma = std::sqrt(variances[k]) / p.inverse_depth;
      if (!px || !(sigma > 0 && sigma < kKnown)) continue;
      const Eigen::Vector2d at = px->cast<double>();
      const auto as_given = given->At(working * at),
                 depth = map->At(working * (center + zoom * (at - center)));
      const double inverse_depth = free.InverseDepthIn(p, image);
      if (!as_given || !depth || !(inverse_depth > 0) || depth->z < kOffsets * std::abs(offset))
        continue;
      views[i].push_back({std::log((depth->z + offset) * inverse_depth),
                          std::log(as_given->z * inverse_depth),
                          std::hypot(sigma, depth->sigma / depth->z)});
    }
  }
  return views;
}

// The image whose depths are judged: one so old that late depths of it have come, else the newest.
const WindowImage& Odometry::ImageToJudge() const {
  const double now = window_.newest().time_s;
  const auto old = std::ranges::find_if(
      window_.images.rbegin(), window_.images.rend(),
      [&](const WindowImage& i) { return i.time_s <= now - DepthTrust::kLatest; });
  return old != window_.images.rend() && DepthNear(old->time_s) ? *old : window_.newest();
}

// Compares, from time to time, depths with those that the images alone tell, but for their unit;
// depths that contradict them are not used any more.
void Odometry::JudgeDepth() {
  const double now = window_.newest().time_s;
  if (!depth_ || is_beginning_ || !(units_per_metre_ > 0) || !depth_trust_.IsDue(now)) return;
  constexpr int kIterations = 10;
  Window free = WithoutDepths();
  const WindowProblem made = ProblemOf(free, window_options_, false);
  InverseDepthState state = made.StateOf(free);
  const InverseDepthReport report =
      solver_.Minimize(made.problem, {.max_iterations = kIterations, .tolerance = 1e-4}, state);
  made.Apply(state, free);
  depth_trust_.Add(now,
                   ViewDepths(free, made.points, report.variances, free.Image(ImageToJudge().id)));
  const std::string problem = depth_trust_.Problem();
  if (problem.empty()) return;
  Log(LogLevel::kWarning, "the depths are not used from now on: {}", problem);
  depth_is_refused_ = true;
  depth_ = nullptr;
  recent_depths_.clear();
  units_per_metre_ = 0;
  for (WindowPoint& p : window_.points) {
    for (Sighting& s : p.sightings) s.measured.reset();
    if (std::exchange(p.is_measured, false))
      p.prior_sigma = std::max(p.prior_inverse_depth, window_.median_inverse_depth);
  }
}

}  // namespace oaslam
