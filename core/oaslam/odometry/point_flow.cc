#include "oaslam/odometry/point_flow.h"

#include <algorithm>
#include <utility>

#include "oaslam/odometry/patch_flow.h"

namespace oaslam {
namespace {

using Places = std::vector<std::optional<Eigen::Vector2f>>;

// Beyond this a patch has met something else: noise moves it by a tenth of a pixel.
constexpr double kMaxReturn = 0.7;

// The median motion of the five followed points that are nearest to `px`.
std::optional<Eigen::Vector2f> MotionNear(const Eigen::Vector2f& px,
                                          std::span<const PointToFollow> points,
                                          const Places& places) {
  constexpr size_t kNearest = 5;
  std::vector<std::pair<float, size_t>> near;
  for (size_t i = 0; i < points.size(); ++i)
    if (places[i]) near.emplace_back((points[i].px - px).squaredNorm(), i);
  if (near.size() < kNearest) return std::nullopt;
  std::ranges::partial_sort(near, near.begin() + kNearest);
  std::vector<float> x, y;
  for (size_t k = 0; k < kNearest; ++k) {
    const size_t i = near[k].second;
    x.push_back(places[i]->x() - points[i].px.x());
    y.push_back(places[i]->y() - points[i].px.y());
  }
  std::ranges::nth_element(x, x.begin() + kNearest / 2);
  std::ranges::nth_element(y, y.begin() + kNearest / 2);
  return Eigen::Vector2f(x[kNearest / 2], y[kNearest / 2]);
}

void FollowLostOnes(std::span<const PointToFollow> points, const GreyPyramid& last,
                    const GreyPyramid& next, Places& places) {
  constexpr double kManyLost = 0.3;  // share: fewer left the view or were hidden
  constexpr double kLeastLost = 15;
  const auto lost =
      static_cast<double>(std::ranges::count_if(places, [](const auto& p) { return !p; }));
  if (lost < kLeastLost || lost < kManyLost * static_cast<double>(points.size())) return;
  const FlowOptions options{.levels = 3};  // the guess is good to some pixels
  Places found(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (places[i]) continue;
    if (const auto motion = MotionNear(points[i].px, points, places))
      found[i] = FollowPatchBothWays(last, next, points[i].px, points[i].px + *motion, options,
                                     kMaxReturn);
  }
  for (size_t i = 0; i < points.size(); ++i)
    if (found[i]) places[i] = found[i];
}

}  // namespace

Places FollowPoints(std::span<const PointToFollow> points, const GreyPyramid& last,
                    const GreyPyramid& next) {
  Places places;
  for (const PointToFollow& p : points)
    places.push_back(FollowPatchBothWays(last, next, p.px, p.guess, {}, kMaxReturn));
  FollowLostOnes(points, last, next, places);
  for (size_t i = 0; i < points.size(); ++i) {
    if (!places[i] || !points[i].earlier) continue;
    const auto moved =
        FollowPatch(*points[i].earlier, next, points[i].earlier_px, *places[i], {.levels = 1});
    if (moved && (*moved - *places[i]).norm() < kMaxShift) places[i] = moved;
  }
  return places;
}

}  // namespace oaslam
