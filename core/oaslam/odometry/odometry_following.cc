// How the odometry follows its points into the next image.
#include <Eigen/Geometry>
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/odometry/image_shift.h"
#include "oaslam/odometry/odometry.h"
#include "oaslam/odometry/point_flow.h"
#include "oaslam/odometry/pose_starts.h"

namespace oaslam {
namespace {

// Whether a small image shows more than darkness or fog, where corners would be noise.
bool HasContrast(const GreyImage& small) {
  constexpr double kLeast = 3;  // grey levels, standard deviation
  double sum = 0, squared = 0;
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      const double grey = small.Row(y)[x];
      sum += grey;
      squared += grey * grey;
    }
  const double count = static_cast<double>(small.width) * small.height, mean = sum / count;
  return squared / count - mean * mean > kLeast * kLeast;
}

}  // namespace

std::optional<Eigen::Vector2f> Odometry::PxOf(const Rigid3& cam_from_anchor,
                                              const WindowPoint& point) const {
  const Eigen::Vector3d x = ScaledPoint(cam_from_anchor, point.ray, point.inverse_depth);
  if (x.z() < kNearest) return std::nullopt;
  return Distort(camera_, ProjectIdeal(camera_, x)).cast<float>();
}

const Odometry::KeptKeyframe* Odometry::EarliestView(const WindowPoint& point) const {
  const auto it = std::ranges::find_if(
      keyframes_, [&](const KeptKeyframe& keyframe) { return point.PxIn(keyframe.id); });
  return it == keyframes_.end() ? nullptr : &*it;
}

// The places in the newest image of the points that were followed up to the last one, if the camera
// has moved about as predicted.
Odometry::FollowedPoints Odometry::FollowFrom(const Rigid3& predicted) const {
  FollowedPoints followed;
  std::vector<PointToFollow> points;
  const WindowImage& last = window_.images[window_.images.size() - 2];
  const std::vector<Rigid3> there_from = window_.FromImages(predicted),
                            here_from = window_.FromImages(last.cam_from_odom);
  for (size_t i = 0; i < window_.points.size(); ++i) {
    const WindowPoint& p = window_.points[i];
    if (!p.is_tracked) continue;
    Eigen::Vector2f guess = p.px;
    const size_t anchor = window_.IndexOf(p.anchor);
    const auto there = PxOf(there_from[anchor], p), here = PxOf(here_from[anchor], p);
    const float most = 0.5F * static_cast<float>(camera_.width);  // more is a wrong depth
    if (there && here && (*there - *here).norm() < most) guess += *there - *here;
    PointToFollow& point = points.emplace_back(PointToFollow{p.px, guess});
    const KeptKeyframe* earlier = EarliestView(p);
    if (earlier && earlier->id != last.id) {
      point.earlier = earlier->pyramid.get();
      point.earlier_px = *p.PxIn(earlier->id);
    }
    followed.indices.push_back(i);
  }
  followed.places = FollowPoints(points, *last_, *present_);
  return followed;
}

double Odometry::FollowedPoints::ShareLost() const {
  const auto lost = std::ranges::count_if(places, [](const auto& place) { return !place; });
  return static_cast<double>(lost) / std::max(1.0, static_cast<double>(places.size()));
}

// The camera at the predicted place, turned from its last pose as the image has shifted.
Rigid3 Odometry::TurnedAsImage(const Rigid3& predicted) const {
  const WindowImage& last = window_.images[window_.images.size() - 2];
  const Eigen::Vector2f middle(0.5F * static_cast<float>(camera_.width),
                               0.5F * static_cast<float>(camera_.height)),
      half = 0.5F * ShiftOfImage(*last_, *present_);
  const auto turn =
      TurnBetween(RayAt(middle - half).homogeneous(), RayAt(middle + half).homogeneous());
  const Eigen::Quaterniond rotation = turn * Eigen::Quaterniond(last.cam_from_odom.rotation);
  return Rigid3(Rigid3::Rotation(rotation), rotation * -predicted.OriginInSource());
}

// Adds the sightings of the newest image, whose pose is the predicted one; returns how many. Where
// many points are lost, and the camera turned otherwise, its pose becomes that.
int Odometry::Follow() {
  constexpr double kManyLost = 0.3;     // share of the points
  constexpr double kOtherwise = 0.025;  // of the width: the error of the shift
  Rigid3& predicted = window_.newest().cam_from_odom;
  FollowedPoints followed = FollowFrom(predicted);
  if (followed.ShareLost() > kManyLost) {
    const Rigid3 turned = TurnedAsImage(predicted);
    const double turn = turned.rotation.angularDistance(predicted.rotation);
    if (turn * camera_.fx > kOtherwise * camera_.width) {
      FollowedPoints again = FollowFrom(turned);
      if (again.ShareLost() < followed.ShareLost()) {
        followed = std::move(again);
        predicted = turned;
      }
    }
  }
  int count = 0;
  for (size_t k = 0; k < followed.places.size(); ++k) {
    WindowPoint& p = window_.points[followed.indices[k]];
    const std::optional<Eigen::Vector2f>& place = followed.places[k];
    p.is_tracked = place && !IsHidden(*place);
    if (!p.is_tracked) continue;
    p.px = *place;
    p.sightings.push_back({window_.newest().id, p.px, RayAt(p.px)});
    ++count;
  }
  return count;
}

// cam_from_odom of the newest image, as the points moved from the last image to it.
Eigen::Matrix3d Odometry::RotationOfFlow(const Rigid3& predicted) const {
  const int newest = window_.newest().id;
  const WindowImage& last = window_.images[window_.images.size() - 2];
  std::vector<Eigen::Vector2d> before, now;
  for (const WindowPoint& p : window_.points) {
    if (p.sightings.empty() || p.sightings.back().image != newest) continue;
    const Eigen::Vector2d* ray = p.anchor == last.id ? &p.ray : nullptr;
    if (p.sightings.size() > 1 && p.sightings[p.sightings.size() - 2].image == last.id)
      ray = &p.sightings[p.sightings.size() - 2].ray;
    if (!ray) continue;
    before.push_back(*ray);
    now.push_back(p.sightings.back().ray);
  }
  const Eigen::Matrix3d last_rotation = last.cam_from_odom.rotation.toRotationMatrix(),
                        start = predicted.rotation.toRotationMatrix() * last_rotation.transpose();
  constexpr size_t kLeast = 8;
  return (before.size() < kLeast ? start : RotationBetween(before, now, start)) * last_rotation;
}

// The newest image shows too little; its pose is the predicted one. What it shows is followed from
// here on.
void Odometry::FollowInertia(const Rigid3& predicted, OdometryEstimate& estimate) {
  if (is_beginning_ || !imu_.CanCarry(window_, seen_s_)) {
    estimate.state = OdometryState::kBlind;
    return;
  }
  estimate.state = OdometryState::kInertial;
  WindowImage& newest = window_.newest();
  newest.cam_from_odom = predicted;
  newest.median_inverse_depth = window_.median_inverse_depth;
  estimate.cam_from_odom = predicted;
  estimate.covariance = covariance_;
  estimate.inliers = 0;
  for (WindowPoint& p : window_.points) {
    if (!p.sightings.empty() && p.sightings.back().image == newest.id) p.sightings.pop_back();
    p.is_tracked = false;
  }
  is_sure_ = false;
  estimate.is_keyframe = HasContrast(present_->level(present_->levels() - 1));
  if (estimate.is_keyframe) MakeKeyframe();
}

}  // namespace oaslam
