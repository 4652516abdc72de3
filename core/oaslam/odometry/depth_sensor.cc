#include "oaslam/odometry/depth_sensor.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "oaslam/util/log.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// The window by its images alone: only its first pose is held, and the farthest one keeps its
// distance.
Window WithoutDepths(const Window& window) {
  Window free = window;
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

}  // namespace

void DepthSensor::Take(double time_s, const std::shared_ptr<const DepthMap>& depth) {
  map_ = is_refused_ ? nullptr : depth;
  Remember(time_s);
}

bool DepthSensor::CanBegin(const Window& window) const {
  if (!map_) return false;
  const auto is_seen = [&](const WindowPoint& p) { return p.is_tracked && DepthAt(p.px); };
  return 2 * std::ranges::count_if(window.points, is_seen) > 3 * kLeastDepths;
}

bool DepthSensor::BeginInMetres() {
  units_per_metre_ = map_ ? 1 : 0;
  return map_ != nullptr;
}

std::optional<MeasuredDepth> DepthSensor::DepthAt(const Eigen::Vector2f& px) const {
  return map_ ? map_->At(scale_ * px.cast<double>()) : std::nullopt;
}

std::optional<MeasuredInverseDepth> DepthSensor::At(const Eigen::Vector2f& px) const {
  if (!(units_per_metre_ > 0)) return std::nullopt;
  const std::optional<MeasuredDepth> depth = DepthAt(px);
  if (!depth) return std::nullopt;
  const double value = 1 / (depth->z * units_per_metre_);
  return MeasuredInverseDepth{value, value * depth->sigma / depth->z};
}

void DepthSensor::MeasureSightings(Window& window) const {
  if (!map_) return;
  for (WindowPoint& p : window.points)
    if (!p.sightings.empty() && p.sightings.back().image == window.newest().id)
      p.sightings.back().measured = At(p.px);
}

void DepthSensor::LearnMetre(const Window& window) {
  constexpr double kMostSpread = 0.1;  // half of the ratios are within
  if (!map_ || units_per_metre_ > 0) return;
  std::vector<double> ratios;
  for (const WindowPoint& p : window.points) {
    if (!p.is_tracked || !p.HasGoodDepth()) continue;
    const auto depth = DepthAt(p.px);
    const double inverse = window.InverseDepthIn(p, window.newest());
    if (depth && inverse > 0) ratios.push_back(1 / (inverse * depth->z));
  }
  if (std::ssize(ratios) < kLeastDepths) return;
  const double median = Median(ratios);
  for (double& ratio : ratios) ratio = std::abs(ratio / median - 1);
  if (Median(std::move(ratios)) < kMostSpread) units_per_metre_ = median;
}

void CompareWithParallax(double median_inverse_depth, WindowPoint& point) {
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
  point.prior_sigma = std::max(std::abs(inverse_depth), median_inverse_depth);
  point.variance = 1 / by_parallax;
}

// Keeps depths that will be judged soon.
void DepthSensor::Remember(double time_s) {
  constexpr double kSeconds = 1;  // bounds the memory
  std::erase_if(recent_, [&](const auto& d) { return d.first < time_s - kSeconds; });
  if (map_ && trust_.IsDue(time_s + kSeconds)) recent_[time_s] = map_;
}

// The depths that came nearest to this time; null where none came within a hundredth of a second.
const DepthMap* DepthSensor::MapNear(double time_s) const {
  constexpr double kTolerance = 0.012;
  const auto after = recent_.lower_bound(time_s);
  const DepthMap* nearest = nullptr;
  double least = kTolerance;
  const auto try_one = [&](const auto& at) {
    if (std::abs(at->first - time_s) >= least) return;
    least = std::abs(at->first - time_s);
    nearest = at->second.get();
  };
  if (after != recent_.end()) try_one(after);
  if (after != recent_.begin()) try_one(std::prev(after));
  return nearest;
}

// What the depths of an image say of its points, by each reading, besides what the images tell.
std::array<DepthTrust::Views, DepthTrust::kReadings.size()> DepthSensor::View(
    const Window& free, std::span<const int> points, std::span<const double> variances,
    const WindowImage& image) const {
  constexpr double kKnown = 0.05;  // by the images, a share
  // Noise counts less in a logarithm to which much was added: points are this far, in offsets.
  constexpr double kOffsets = 4;
  const DepthMap* given = MapNear(image.time_s);
  std::array<DepthTrust::Views, DepthTrust::kReadings.size()> views;
  for (size_t i = 0; i < views.size(); ++i) {
    const auto& [zoom, offset, delay] = DepthTrust::kReadings[i];
    const DepthMap* map = MapNear(image.time_s + delay);
    if (!given || !map) continue;
    for (size_t k = 0; k < points.size(); ++k) {
      const WindowPoint& p = free.points[points[k]];
      const Eigen::Vector2f* px = p.PxIn(image.id);
      const double sigma = std::sqrt(variances[k]) / p.inverse_depth;
      if (!px || !(sigma > 0 && sigma < kKnown)) continue;
      const Eigen::Vector2d at = px->cast<double>();
      const auto as_given = given->At(scale_ * at),
                 depth = map->At(scale_ * (center_ + zoom * (at - center_)));
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
const WindowImage& DepthSensor::ImageToJudge(const Window& window) const {
  const double now = window.newest().time_s;
  const auto old = std::find_if(  // Emscripten's std::ranges::find_if takes no iterators
      window.images.rbegin(), window.images.rend(),
      [&](const WindowImage& i) { return i.time_s <= now - DepthTrust::kLatest; });
  return old != window.images.rend() && MapNear(old->time_s) ? *old : window.newest();
}

void DepthSensor::Judge(const WindowOptions& options, InverseDepthSolver& solver, Window& window) {
  const double now = window.newest().time_s;
  if (!map_ || !(units_per_metre_ > 0) || !trust_.IsDue(now)) return;
  constexpr int kIterations = 10;
  Window free = WithoutDepths(window);
  const WindowProblem made = ProblemOf(free, options, false);
  InverseDepthState state = made.StateOf(free);
  const InverseDepthReport report =
      solver.Minimize(made.problem, {.max_iterations = kIterations, .tolerance = 1e-4}, state);
  made.Apply(state, free);
  trust_.Add(now, View(free, made.points, report.variances, free.Image(ImageToJudge(window).id)));
  const std::string problem = trust_.Problem();
  if (problem.empty()) return;
  Log(LogLevel::kWarning, "the depths are not used from now on: {}", problem);
  Refuse(window);
}

void DepthSensor::Refuse(Window& window) {
  is_refused_ = true;
  map_ = nullptr;
  recent_.clear();
  units_per_metre_ = 0;
  for (WindowPoint& p : window.points) {
    for (Sighting& s : p.sightings) s.measured.reset();
    if (std::exchange(p.is_measured, false))
      p.prior_sigma = std::max(p.prior_inverse_depth, window.median_inverse_depth);
  }
}

}  // namespace oaslam
