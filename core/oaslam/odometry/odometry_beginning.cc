// The first images, until the motion is decided.
#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/geometry/degree.h"
#include "oaslam/odometry/odometry.h"

namespace oaslam {

// Adds the first points. Where enough of them have a depth, the motion needs no beginning.
void Odometry::AddFirstPoints() {
  const bool has_depths = depth_.BeginInMetres();
  AddPoints();
  if (!has_depths) return;
  if (std::ranges::count_if(window_.points, &WindowPoint::is_measured) >=
      DepthSensor::kLeastDepths) {
    is_beginning_ = false;
    UpdateMedianDepth(false, window_);
    return;
  }
  depth_.ForgetMetre();
  window_.points.clear();
  AddPoints();
}

void Odometry::EstimateBeginning(OdometryEstimate& estimate) {
  WindowImage& newest = window_.newest();
  const WindowImage& last = window_.images[window_.images.size() - 2];
  // A turn that is less certain would look like parallax.
  constexpr double kCertain = 0.2 * kDegree;
  const bool is_known = newest.turn && newest.turn->variance < kCertain * kCertain;
  const Eigen::Matrix3d rotation =
      is_known ? (newest.turn->second_from_first * last.cam_from_odom.rotation).toRotationMatrix()
               : RotationOfFlow(newest.cam_from_odom);
  newest.cam_from_odom = Rigid3(rotation, -(rotation * last.cam_from_odom.OriginInSource()));
  estimate.inliers = estimate.tracked;
  const double time_s = newest.time_s;
  // Where nothing tells how far the camera has moved since the last image.
  preliminary_ = newest.cam_from_odom * last.cam_from_odom.Inverse() * preliminary_;
  while (window_.images.size() > kLeastImages && MatchesOfFirst(window_) < kLeastMatches)
    DropFirst();
  // All motions are compared from time to time; in between the pose is by the one that leads.
  constexpr double kSeconds = 0.1;
  const bool is_compared = !leader_ || std::abs(time_s - compared_s_) > kSeconds;
  Beginning beginning = is_compared
                            ? BeginMotion(window_, leader_ ? &*leader_ : nullptr, window_options_,
                                          options_.beginning, camera_.width, rng_)
                            : FollowLeader(window_, *leader_, window_options_);
  if (beginning.is_known) preliminary_ = beginning.window.newest().cam_from_odom;
  estimate.cam_from_odom = preliminary_;
  if (!beginning.is_known) return;
  if (is_compared) compared_s_ = time_s;
  if (!beginning.is_decided) {
    leader_ = std::move(beginning.window);
    return;
  }
  window_ = std::move(beginning.window);
  is_beginning_ = false;
  leader_.reset();
  estimate.state = OdometryState::kTracking;
  keyframe_is_due_ = true;  // with the unit of length
  FlagOutliers(window_options_, window_);
  UpdateMedianDepth(false, window_);
}

// The next keyframe becomes the first image of the beginning, where the motion that leads has it.
void Odometry::DropFirst() {
  do window_.Remove(window_.images.front().id);
  while (!window_.images.front().is_keyframe);
  WindowImage& first = window_.images.front();
  first.is_held = true;
  if (!leader_) return;
  while (leader_->images.size() > 1 && leader_->images.front().id < first.id)
    leader_->Remove(leader_->images.front().id);
  if (leader_->images.front().id != first.id) return;
  const Rigid3 change = first.cam_from_odom.Inverse() * leader_->images.front().cam_from_odom;
  for (WindowImage& image : window_.images) image.cam_from_odom = image.cam_from_odom * change;
}

}  // namespace oaslam
