#include "oaslam/odometry/motions_since.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

namespace oaslam {
namespace {

constexpr double kLoose = 20;  // times the sigma of a depth that rests on the motion

}  // namespace

MotionsSince::MotionsSince(const Window& window, const WindowImage& pivot,
                           const WindowOptions& options)
    : window_(window), pivot_(static_cast<int>(window.IndexOf(pivot.id))), pivot_id_(pivot.id) {
  Window held = window;
  for (WindowImage& image : held.images) image.is_held = image.id <= pivot_id_;
  made_ = ProblemOf(held, options, true);
  bare_ = WithoutPriors(made_.problem);
  loose_ = made_.problem;
  loose_.velocities.clear();
  loose_.turn_rates.clear();
  loose_.inertial.reset();
  for (size_t k = 0; k < made_.points.size(); ++k)
    if (IsNew(k) && !window_.points[made_.points[k]].is_measured) loose_.points[k].sigma *= kLoose;
}

MotionsSince::Start MotionsSince::Present() const {
  Start start{made_.StateOf(window_)};
  start.cost = CostOfImages(bare_, start.state);
  return start;
}

MotionsSince::Start MotionsSince::WithPoses(std::span<const std::pair<int, Rigid3>> poses) const {
  // How the rotation of an image changes, from the left, and where its camera is.
  struct Known {
    double time_s = 0;
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
    Eigen::Vector3d center;
  };
  const WindowImage& pivot = window_.images[pivot_];
  std::vector<Known> known{
      {.time_s = pivot.time_s, .center = pivot.cam_from_odom.OriginInSource()}};
  for (const auto& [id, pose] : poses) {
    const WindowImage& image = window_.Image(id);
    known.push_back({image.time_s,
                     Eigen::Quaterniond(pose.rotation * image.cam_from_odom.rotation.conjugate()),
                     pose.OriginInSource()});
  }
  Start start{made_.StateOf(window_)};
  for (int k = 0; k < made_.problem.free_poses; ++k) {
    const WindowImage& image = window_.images[made_.images[k]];
    size_t next = 1;
    while (next + 1 < known.size() && known[next].time_s < image.time_s) ++next;
    const Known &before = known[next - 1], &after = known[next];
    const double share = (image.time_s - before.time_s) / (after.time_s - before.time_s);
    const Eigen::Quaterniond rotation =
        before.turn.slerp(share, after.turn) * Eigen::Quaterniond(image.cam_from_odom.rotation);
    const Eigen::Vector3d center = (1 - share) * before.center + share * after.center;
    start.state.poses[k] = Rigid3(Rigid3::Rotation(rotation), rotation * -center);
  }
  InverseDepthState searched = start.state;
  SearchDepths(window_.median_inverse_depth, bare_, searched);
  for (size_t k = 0; k < made_.points.size(); ++k)
    if (IsNew(k)) start.state.inverse_depths[k] = searched.inverse_depths[k];
  start.cost = CostOfImages(bare_, start.state);
  return start;
}

void MotionsSince::Improve(int iterations, InverseDepthSolver& solver, Start& start) const {
  solver.Minimize(loose_, {.max_iterations = iterations, .tolerance = 1e-4}, start.state);
  start.cost = CostOfImages(bare_, start.state);
}

Window MotionsSince::Made(const Start& start) const {
  Window window = window_;
  made_.Apply(start.state, window);
  for (size_t k = 0; k < made_.points.size(); ++k) {
    if (!IsNew(k)) continue;
    WindowPoint& p = window.points[made_.points[k]];
    if (p.is_measured) continue;
    p.prior_inverse_depth = p.inverse_depth;
    p.prior_sigma = std::max(std::abs(p.inverse_depth), window.median_inverse_depth);
  }
  return window;
}

// The depth of a point rests on the motion that is in question.
bool MotionsSince::IsNew(size_t point) const {
  const WindowPoint& p = window_.points[made_.points[point]];
  return p.anchor >= pivot_id_ || !p.HasDepth();
}

}  // namespace oaslam
