#include "oaslam/odometry/window.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "oaslam/util/check.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

constexpr double kBehind = 1e-3;  // times the inverse depth: at the camera or behind it

auto FindImage(auto& images, int id) {
  const auto at = std::ranges::lower_bound(images, id, {}, &WindowImage::id);
  OASLAM_CHECK(at != images.end() && at->id == id);
  return at;
}

Eigen::Vector3d PointIn(const WindowImage& to, const WindowImage& anchor,
                        const WindowPoint& point) {
  return ScaledPoint(to.cam_from_odom * anchor.cam_from_odom.Inverse(), point.ray,
                     point.inverse_depth);
}

// Finds the images of a point, which it names in the order of their ids.
class ImagesOfPoint {
 public:
  ImagesOfPoint(const Window& window, const WindowPoint& point)
      : images_(window.images), anchor_(window.IndexOf(point.anchor)), at_(anchor_) {}

  size_t anchor() const { return anchor_; }
  // Of a sighting that is not before the one asked for last.
  size_t Of(const Sighting& sighting) {
    while (at_ < images_.size() && images_[at_].id < sighting.image) ++at_;
    OASLAM_CHECK(at_ < images_.size() && images_[at_].id == sighting.image);
    return at_;
  }

 private:
  const std::vector<WindowImage>& images_;
  size_t anchor_, at_;
};

bool HasFreeImage(const Window& window, const WindowPoint& point) {
  ImagesOfPoint of(window, point);
  return !window.images[of.anchor()].is_held ||
         std::ranges::any_of(point.sightings,
                             [&](const Sighting& s) { return !window.images[of.Of(s)].is_held; });
}

// The relative poses of images: each two of them are asked for many times.
class RelativePoses {
 public:
  explicit RelativePoses(const Window& window)
      : images_(window.images), poses_(images_.size() * images_.size()) {}

  const Rigid3& Of(size_t to, size_t from) {
    std::optional<Rigid3>& pose = poses_[to * images_.size() + from];
    if (!pose) pose = images_[to].cam_from_odom * images_[from].cam_from_odom.Inverse();
    return *pose;
  }

 private:
  const std::vector<WindowImage>& images_;
  std::vector<std::optional<Rigid3>> poses_;
};

const Sighting* SightingIn(const WindowPoint& point, int image) {
  const auto at = std::ranges::lower_bound(point.sightings, image, {}, &Sighting::image);
  return at != point.sightings.end() && at->image == image ? &*at : nullptr;
}

}  // namespace

const Eigen::Vector2f* WindowPoint::PxIn(int image) const {
  if (image == anchor) return &anchor_px;
  const Sighting* seen = SightingIn(*this, image);
  return seen ? &seen->px : nullptr;
}

const Eigen::Vector2d* WindowPoint::RayIn(int image) const {
  if (image == anchor) return &ray;
  const Sighting* seen = SightingIn(*this, image);
  return seen ? &seen->ray : nullptr;
}

void WindowPoint::SetMeasured(const MeasuredInverseDepth& measured) {
  is_measured = true;
  prior_inverse_depth = measured.value;
  prior_sigma = measured.sigma;
}

bool Window::Has(int id) const {
  return std::ranges::binary_search(images, id, {}, &WindowImage::id);
}

const WindowImage& Window::Image(int id) const { return *FindImage(images, id); }
WindowImage& Window::Image(int id) { return *FindImage(images, id); }

size_t Window::IndexOf(int id) const { return FindImage(images, id) - images.begin(); }

std::vector<Rigid3> Window::FromImages(const Rigid3& x_from_odom) const {
  std::vector<Rigid3> poses;
  for (const WindowImage& image : images)
    poses.push_back(x_from_odom * image.cam_from_odom.Inverse());
  return poses;
}

double Window::InverseDepthIn(const WindowPoint& point, const WindowImage& image) const {
  const double z = PointIn(image, Image(point.anchor), point).z();
  return z > kBehind ? point.inverse_depth / z : point.inverse_depth;
}

void Window::Remove(int id) {
  for (WindowPoint& point : points) {
    const auto seen = std::ranges::lower_bound(point.sightings, id, {}, &Sighting::image);
    if (seen != point.sightings.end() && seen->image == id) point.sightings.erase(seen);
    if (point.anchor != id || point.sightings.empty()) continue;
    const Sighting next = point.sightings.front();
    point.edge = point.edge.In(Image(next.image).cam_from_odom * Image(id).cam_from_odom.Inverse());
    const double depth_there = InverseDepthIn(point, Image(next.image));
    point.variance *= std::pow(depth_there / std::max(point.inverse_depth, 1e-6), 2);
    point.inverse_depth = point.prior_inverse_depth = depth_there;
    if (std::exchange(point.is_measured, false))
      point.prior_sigma = std::max(depth_there, median_inverse_depth);
    if (next.measured) point.SetMeasured(*next.measured);
    point.anchor = next.image;
    point.anchor_px = next.px;
    point.ray = next.ray;
    point.sightings.erase(point.sightings.begin());
  }
  std::erase_if(points, [&](const WindowPoint& p) { return p.anchor == id; });
  std::vector<bool> is_erased(images.size());
  is_erased[IndexOf(id)] = true;
  EraseImages(is_erased);
}

void Window::EraseImages(const std::vector<bool>& is_erased) {
  for (size_t i = 0; i + 1 < images.size(); ++i) {
    if (!is_erased[i]) continue;
    const std::optional<Turn>& first = images[i].turn;
    std::optional<Turn>& second = images[i + 1].turn;
    if (images[i].push && images[i + 1].push && first)
      images[i + 1].push =
          Composed(*images[i].push, first->second_from_first.conjugate().toRotationMatrix(),
                   *images[i + 1].push);
    else
      images[i + 1].push.reset();
    if (first && second)
      second = Turn{(second->second_from_first * first->second_from_first).normalized(),
                    first->variance + second->variance};
    else
      second.reset();
  }
  size_t kept = 0;
  for (size_t i = 0; i < images.size(); ++i)
    if (!is_erased[i]) images[kept++] = images[i];
  images.resize(kept);
}

void Window::RemoveUnused(int kept_image) {
  std::erase_if(points, [&](const WindowPoint& p) {
    return !p.is_tracked && (p.sightings.empty() || !HasFreeImage(*this, p));
  });
  constexpr int kHeldSightings = 6;    // of a point: more of them add time, but no new directions
  constexpr int kNewestKeyframes = 4;  // stay: the motion before the window is read from them
  std::vector<bool> is_unused(images.size(), true);
  for (WindowPoint& p : points) {
    int held = 0;
    {
      ImagesOfPoint of(*this, p);
      is_unused[of.anchor()] = false;
      for (const Sighting& s : p.sightings) held += images[of.Of(s)].is_held;
    }
    ImagesOfPoint of(*this, p);
    std::erase_if(p.sightings, [&](const Sighting& s) {
      const size_t i = of.Of(s);
      const bool is_erased = images[i].is_held && held-- > kHeldSightings;
      if (!is_erased) is_unused[i] = false;
      return is_erased;
    });
  }
  int keyframes = 0;
  for (size_t i = images.size(); i-- > 0;) {
    if (images[i].is_keyframe) ++keyframes;
    if (!images[i].is_held || (images[i].is_keyframe && keyframes <= kNewestKeyframes) ||
        images[i].id == kept_image)
      is_unused[i] = false;
  }
  EraseImages(is_unused);
}

InverseDepthState WindowProblem::StateOf(const Window& window) const {
  InverseDepthState state;
  for (const int i : images) state.poses.push_back(window.images[i].cam_from_odom);
  for (const int i : points) state.inverse_depths.push_back(window.points[i].inverse_depth);
  if (window.inertial) state.inertial = window.inertial->value;
  return state;
}

void WindowProblem::Apply(const InverseDepthState& state, Window& window) const {
  for (size_t k = 0; k < images.size(); ++k)
    window.images[images[k]].cam_from_odom = state.poses[k];
  for (size_t k = 0; k < points.size(); ++k)
    window.points[points[k]].inverse_depth = state.inverse_depths[k];
  if (window.inertial) window.inertial->value = state.inertial;
}

int WindowProblem::PoseOf(const Window& window, int image) const {
  for (size_t k = 0; k < images.size(); ++k)
    if (window.images[images[k]].id == image) return static_cast<int>(k);
  return -1;
}

std::optional<InertialTriple> TripleOf(const Window& window, size_t last) {
  const auto& images = window.images;
  if (last < 2 || !images[last - 1].push || !images[last].push) return std::nullopt;
  return InertialTriple{0, 0, 0, *images[last - 1].push, *images[last].push};
}

WindowProblem ProblemOf(const Window& window, const WindowOptions& options, bool with_outliers) {
  WindowProblem made;
  InverseDepthProblem& problem = made.problem;
  problem.corner_chi2 = options.corner_chi2;
  problem.huber_chi2 = options.huber_sigmas * options.huber_sigmas;
  problem.least_inverse_depth = -0.05 * window.median_inverse_depth;
  const int count = static_cast<int>(window.images.size());
  for (int i = 0; i < count; ++i)
    if (!window.images[i].is_held) made.images.push_back(i);
  problem.free_poses = static_cast<int>(made.images.size());
  for (int i = 0; i < count; ++i)
    if (window.images[i].is_held) made.images.push_back(i);
  std::vector<int> pose_of(count);  // by index of the image
  for (int k = 0; k < count; ++k) pose_of[made.images[k]] = k;

  const double inverse_sigma = options.focal_px / options.sigma_px;
  RelativePoses relative(window);
  for (size_t i = 0; i < window.points.size(); ++i) {
    const WindowPoint& p = window.points[i];
    if (p.sightings.empty() || !HasFreeImage(window, p)) continue;
    const int point = static_cast<int>(problem.points.size());
    ImagesOfPoint of(window, p);
    made.points.push_back(static_cast<int>(i));
    problem.points.push_back(
        {pose_of[of.anchor()], p.ray, p.prior_inverse_depth, p.prior_sigma, p.is_measured});
    for (const Sighting& s : p.sightings) {
      const size_t image = of.Of(s);
      problem.measurements.push_back(
          {point, pose_of[image], s.ray,
           inverse_sigma * p.edge.In(relative.Of(image, of.anchor())).RootOfInformation(),
           s.is_outlier && !with_outliers});
    }
  }

  // The free images, with the two newest of the held ones before them.
  std::vector<int> in_time;
  for (int i = 0; i < count; ++i)
    if (!window.images[i].is_held) in_time.push_back(i);
  int before = 0;
  for (int i = count; i-- > 0 && before < 2;) {
    if (!window.images[i].is_held) continue;
    in_time.push_back(i);
    ++before;
  }
  std::ranges::sort(in_time);
  if (window.inertial)
    problem.inertial = InertialProblem{window.inertial->prior, window.inertial->lever};
  for (size_t k = 2; k < in_time.size(); ++k) {
    const WindowImage &a = window.images[in_time[k - 2]], &b = window.images[in_time[k - 1]],
                      &c = window.images[in_time[k]];
    const double first = b.time_s - a.time_s, second = c.time_s - b.time_s;
    auto triple = window.inertial && in_time[k] == in_time[k - 2] + 2 ? TripleOf(window, in_time[k])
                                                                      : std::nullopt;
    if (triple) {
      triple->before = pose_of[in_time[k - 2]];
      triple->middle = pose_of[in_time[k - 1]];
      triple->after = pose_of[in_time[k]];
      triple->sigma = window.inertial->noise * std::sqrt(triple->seconds());
      problem.inertial->triples.push_back(*std::move(triple));
    } else {
      problem.velocities.push_back(
          {pose_of[in_time[k - 2]], pose_of[in_time[k - 1]], pose_of[in_time[k]], first, second,
           options.velocity_sigma * 0.5 * (first + second) / window.median_inverse_depth});
    }
    // A gyroscope tells more.
    if (!c.turn)
      problem.turn_rates.push_back({pose_of[in_time[k - 2]], pose_of[in_time[k - 1]],
                                    pose_of[in_time[k]], first, second,
                                    options.turn_rate_sigma * std::sqrt(0.5 * (first + second))});
  }
  for (int i = 1; i < count; ++i) {
    const WindowImage &first = window.images[i - 1], &second = window.images[i];
    if (second.turn && !(first.is_held && second.is_held))
      problem.rotations.push_back({pose_of[i - 1], pose_of[i], *second.turn});
  }
  if (window.unit && window.Has(window.unit->first) && window.Has(window.unit->second) &&
      !window.Image(window.unit->second).is_held)
    problem.length = {made.PoseOf(window, window.unit->first),
                      made.PoseOf(window, window.unit->second), window.unit->length,
                      1e-3 * window.unit->length};
  return made;
}

WindowFit FlagOutliers(const WindowOptions& options, Window& window) {
  constexpr double kSeconds = 0.5;
  const WindowImage& newest = window.newest();
  WindowFit fit;
  int recent = 0;
  RelativePoses relative(window);
  for (WindowPoint& p : window.points) {
    const double most_px = p.HasGoodDepth() ? options.known_outlier_px : options.outlier_px;
    ImagesOfPoint of(window, p);
    for (Sighting& s : p.sightings) {
      const size_t i = of.Of(s);
      const WindowImage& image = window.images[i];
      if (window.images[of.anchor()].is_held && image.is_held) continue;
      const Rigid3& there = relative.Of(i, of.anchor());
      const Eigen::Vector3d x = ScaledPoint(there, p.ray, p.inverse_depth);
      const bool is_behind = x.z() < kBehind;
      const double off_px =
          is_behind ? INFINITY
                    : p.edge.In(there).Off(x.head<2>() / x.z() - s.ray) * options.focal_px;
      s.is_outlier = is_behind || off_px > most_px;
      s.fits = off_px <= options.outlier_px;
      if (newest.time_s - image.time_s < kSeconds) {
        fit.cost += std::pow(std::min(kMostSigmas, off_px / options.sigma_px), 2);
        ++recent;
      }
      if (image.id != newest.id) continue;
      p.is_tracked = !s.is_outlier;
      fit.inliers += p.DidFit() && s.fits;
      fit.compared += p.DidFit();
    }
  }
  fit.cost /= std::max(1, recent);
  return fit;
}

void UpdateMedianDepth(bool smoothed, Window& window) {
  constexpr size_t kLeast = 10;  // a median of fewer says little
  std::vector<double> seen;
  for (const WindowPoint& p : window.points)
    if (p.is_tracked && p.HasDepth()) seen.push_back(window.InverseDepthIn(p, window.newest()));
  if (seen.size() >= kLeast) {
    const double median = Median(seen);
    window.median_inverse_depth =
        smoothed ? 0.8 * window.median_inverse_depth + 0.2 * median : median;
  }
  window.newest().median_inverse_depth = window.median_inverse_depth;
}

}  // namespace oaslam
