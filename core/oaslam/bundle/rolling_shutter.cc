#include "oaslam/bundle/rolling_shutter.h"

#include <memory>

#include "oaslam/bundle/camera_motion.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// Moves the key points of a keyframe from where they were read out (`rolled`) to where they were at
// the time of its pose.
Features AtOneInstant(const Map& map, KeyframeId id, const Features& rolled,
                      const CameraVelocity& velocity, double readout_s) {
  const Keyframe& keyframe = map.keyframes.At(id);
  const Camera& camera = map.cameras[static_cast<size_t>(keyframe.camera)];
  const double usual_depth = map.MedianDepth(id);
  Features still = rolled;
  for (size_t i = 0; i < still.keypoints.size(); ++i) {
    const Eigen::Vector2d px = rolled.keypoints[i].px.cast<double>();
    const Landmark* landmark =
        keyframe.landmarks[i].IsValid() ? map.landmarks.Find(keyframe.landmarks[i]) : nullptr;
    const double depth =
        landmark ? (keyframe.cam_from_world * landmark->position).z() : usual_depth;
    if (!(depth > 0)) continue;
    const double late_s = ((Distort(camera, px).y() + 0.5) / camera.height - 0.5) * readout_s;
    const Eigen::Vector3d then = depth * RayOf(camera, px);
    const Eigen::Vector3d now = then - late_s * (velocity.v + velocity.w.cross(then));
    if (now.z() > 0) still.keypoints[i].px = ProjectIdeal(camera, now).cast<float>();
  }
  still.BuildGrid();
  return still;
}

}  // namespace

Map WithoutReadout(const Map& map, std::span<const FramePose> trajectory, double readout_s,
                   const BundleConfig& config) {
  // Rounds, since key points and map depend on each other.
  constexpr int kRounds = 3, kIterations = 20;
  Map still = map;
  if (map.keyframes.size() < 3) return still;
  for (int round = 0; round < kRounds; ++round) {
    const CameraMotion motion(still, trajectory);
    for (const KeyframeId id : map.keyframes.Ids()) {
      const Keyframe& rolled = map.keyframes.At(id);
      const auto velocity = motion.At(rolled.timestamp);
      if (!velocity) continue;
      auto features = std::make_shared<const Features>(
          AtOneInstant(still, id, *rolled.features, *velocity, readout_s));
      still.keyframes.MutableAt(id).features = std::move(features);
    }
    ApplyCorrection(GlobalBundleAdjustment(still, kIterations, config), still);
  }
  for (const KeyframeId id : still.keyframes.Ids()) still.UpdateCovisibility(id);
  return still;
}

}  // namespace oaslam
