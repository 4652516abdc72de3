#include "oaslam/objects/box_motion.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {

Box BoxAfterMotion(const Box& earlier, const Rigid3& now_from_then, double inverse_depth,
                   const Camera& camera) {
  // The point on the line of sight, divided by its depth, which is finite also at infinity.
  const Eigen::Vector3d moved = now_from_then.rotation * RayOf(camera, CenterPixel(earlier)) +
                                inverse_depth * now_from_then.translation;
  if (moved.z() <= 0) return {};
  const Eigen::Vector2d center =
      ProjectIdeal(camera, moved) + Eigen::Vector2d(kBoxFromPixel, kBoxFromPixel);
  const Eigen::Vector2d half = Eigen::Vector2d(earlier.Width(), earlier.Height()) / (2 * moved.z());
  return {center.x() - half.x(), center.y() - half.y(), center.x() + half.x(),
          center.y() + half.y()};
}

double OverlapAfterMotion(const Box& earlier, const Box& detected, unsigned char truncated,
                          const MotionSinceBox& motion, const Camera& camera) {
  // The inverse depth w for which R x + w t is nearly parallel to the line of sight s of the
  // detection: the least squares of (R x + w t) x s = 0.
  const Eigen::Vector3d sight = RayOf(camera, CenterPixel(detected)).normalized();
  const Eigen::Vector3d rotated =
      (motion.now_from_then.rotation * RayOf(camera, CenterPixel(earlier))).cross(sight);
  const Eigen::Vector3d shifted = motion.now_from_then.translation.cross(sight);
  const double squared = shifted.squaredNorm();
  const double inverse_depth =
      squared > 0 ? std::clamp(-rotated.dot(shifted) / squared, 0.0, 1 / motion.min_depth) : 0.0;
  const Box moved = BoxAfterMotion(earlier, motion.now_from_then, inverse_depth, camera);
  return IoU(ClipAtTruncation(moved, detected, truncated), detected);
}

}  // namespace oaslam
