#include "oaslam/tracking/odometry_registration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "oaslam/estimation/similarity_fit.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

bool KnowsWay(const Frame& frame) { return frame.motion && !frame.motion->is_preliminary; }

// The length of the odometry's unit in units of the map, by points with a depth that lie on mapped
// objects; nothing where these are few.
std::optional<double> UnitOnObjects(const Frame& frame, const Rigid3& cam_from_map,
                                    const Map& map) {
  constexpr double kInner = 0.5;  // of the squared radius: beyond is the background, too
  constexpr size_t kLeast = 10;
  struct Target {
    Eigen::Matrix3d unit_from_cam;  // maps the ellipsoid to the unit sphere
    Eigen::Vector3d camera;         // in the frame of that sphere
  };
  std::vector<Target> targets;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    const Eigen::Matrix3d unit_from_map = ScaledAxes(object.ellipsoid).inverse();
    targets.push_back({unit_from_map * cam_from_map.rotation.conjugate().toRotationMatrix(),
                       unit_from_map * (cam_from_map.OriginInSource() - object.ellipsoid.center)});
  });
  std::vector<double> units;
  for (const FrameMotion::KnownDepth& point : frame.motion->depths) {
    const Eigen::Vector3d ray = RayOf(*frame.camera, point.px.cast<double>());  // z = 1
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& [unit_from_cam, camera] : targets) {
      const Eigen::Vector3d d = unit_from_cam * ray;
      const double dd = d.squaredNorm(), middle = -camera.dot(d) / dd;
      const double off = (camera + middle * d).squaredNorm();
      const double depth = middle - std::sqrt(std::max(0.0, 1 - off) / dd);
      if (off < kInner && depth > 0) nearest = std::min(nearest, depth);
    }
    if (std::isfinite(nearest)) units.push_back(nearest * point.inverse_depth);
  }
  return units.size() < kLeast ? std::nullopt : std::optional(Median(std::move(units)));
}

}  // namespace

void OdometryRegistration::Add(const Frame& frame, const Relocalization& in_map,
                               const std::optional<double>& unit, const Map& map) {
  constexpr size_t kMost = 100;  // 3 s at 30 Hz: the odometry drifts
  const double sigma = in_map.sigma_position();
  if (!KnowsWay(frame) || !(sigma > 0)) return;
  if (frame.motion->run != run_) sights_.clear();
  run_ = frame.motion->run;
  sights_.push_back({frame.timestamp, frame.motion->cam_from_odom, in_map.cam_from_world, sigma,
                     unit ? unit : UnitOnObjects(frame, in_map.cam_from_world, map)});
  if (sights_.size() > kMost) sights_.erase(sights_.begin());
}

std::optional<OdometryRegistration::Registered> OdometryRegistration::PoseOf(
    const Frame& frame) const {
  constexpr double kMaxSeconds = 15;         // since the camera was found: the odometry drifts
  constexpr double kSigmaOfUnit = 0.1;       // relative: ellipsoids are rough surfaces
  constexpr double kSigmaOfRotation = 0.02;  // about that of single images by objects
  constexpr double kMinShare = 0.6;          // of the images that must agree
  if (!KnowsWay(frame) || sights_.empty() || frame.motion->run != run_ ||
      std::abs(frame.timestamp - sights_.back().timestamp) > kMaxSeconds)
    return std::nullopt;
  std::vector<PosePair> pairs;
  std::vector<double> units, sigmas;
  for (const Sight& sight : sights_) {
    pairs.push_back({sight.cam_from_odom, sight.cam_from_map, sight.sigma});
    sigmas.push_back(sight.sigma);
    if (sight.unit) units.push_back(*sight.unit);
  }
  if (units.empty()) return std::nullopt;
  const SimilarityFit fit =
      FitSimilarity(pairs, ScalePrior{Median(std::move(units)), kSigmaOfUnit});
  const double agreeing = fit.inliers / static_cast<double>(pairs.size());
  if (!fit.success || agreeing < kMinShare) return std::nullopt;
  // Images that follow each other show the same objects with the same errors: their number does not
  // make the pose more certain.
  const double sigma = Median(std::move(sigmas));
  return Registered{{(Similarity(frame.motion->cam_from_odom) * fit.b_from_a.Inverse()).AsPose(),
                     sigma / std::numbers::sqrt3, kSigmaOfRotation},
                    agreeing,
                    fit.b_from_a.scale};
}

}  // namespace oaslam
