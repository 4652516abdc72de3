#pragma once

#include <optional>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// The source of a pose. kMap: landmarks of the map that were matched in the image; kMotion: dead
// reckoning from the newest pose by the map, which is more than some tenths of a second old only in
// the state kOdometry, or, before there is a map, in the state kPreliminary; kObjects: mapped
// objects in the image; kRegistration: the camera's motion, placed by several images around it that
// were found by objects or points; kNone: there is no pose.
enum class PoseSource { kNone, kMap, kMotion, kObjects, kRegistration };

// "none", "map", "motion", "objects", "registration".
OASLAM_API const char* ToString(PoseSource source);

// The camera's pose in a world other than TrackingResult::world, in the units of that world.
struct PoseElsewhere {
  WorldId world;
  TrackingState state = TrackingState::kLost;
  Rigid3 world_from_cam;
  // For a world that was joined, the covariance of the pose in TrackingResult::world, in this
  // world's unit. It does not include the error of the transformation between the two worlds
  // (mostly some percent of the distance).
  PoseCovariance covariance = PoseCovariance::Zero();
  bool is_uncertain = false;
  double confidence = 0;  // probability that the pose is right
  double depth = 0;       // median depth of what supports the pose; 0 without any

  // Multiplies all lengths by `factor`, after the unit of the world has changed.
  void ScaleLengths(double factor) {
    world_from_cam.translation *= factor;
    depth *= factor;
    covariance = WithScaledLengths(covariance, factor);
  }
};

// The tracking result of one image:
//
//   const TrackingResult result = slam.Process({image, timestamp});
//   if (const auto world_from_cam = result.PoseIn(world_of_my_content))
//     Draw(*world_from_cam, SigmaOfPosition(result.covariance));
//   else
//     std::cout << ToString(result.state) << "\n";
struct TrackingResult {
  int frame = 0;  // counted from 0 since the start, Load or Reset; -1: no image yet
  double timestamp = 0;
  TrackingState state = TrackingState::kLost;
  // The world of the map, in which the pose is. The world changes when a lost camera continues in
  // another submap (never while the map was loaded, has anchors or is in metres; the submaps may be
  // joined once the camera sees the first one again), when the map is joined with one in metres,
  // and by SetMetresPerUnit, Load and Reset. An application must keep the world with its own
  // coordinates; anchors (PlaceAnchor) move with their map.
  WorldId world;

  // world_from_cam: the camera's pose in a world, in map units (OpenCV axes: x right, y down, z
  // forward). Nothing where the camera has none in that world.
  std::optional<Rigid3> PoseIn(WorldId asked) const {
    if (asked == world) return world_from_cam_;
    for (const PoseElsewhere& other : elsewhere)
      if (other.world == asked) return other.world_from_cam;
    return std::nullopt;
  }
  // The camera's poses in other worlds that earlier results have named. For each world whose submap
  // was joined with the main one: the pose by the transformation at the joining, so that content
  // made in that world keeps its place. While the camera is lost in `world` and another submap
  // grows, the last element is the pose in that submap, if it is tracked there.
  std::vector<PoseElsewhere> elsewhere;
  // Whether the camera has a pose in `world`.
  bool HasPose() const { return world_from_cam_.has_value(); }
  // Sets or removes the pose, in `world`.
  void SetPose(const std::optional<Rigid3>& world_from_cam) { world_from_cam_ = world_from_cam; }

  PoseSource source = PoseSource::kNone;
  // The covariance of the pose, in the frame and axes that PoseCovariance documents; 0 without a
  // pose. It includes drift, which a loop closure would correct, as far as the odometry can
  // estimate its scale drift (docs/lab/uncertainty.md).
  PoseCovariance covariance = PoseCovariance::Zero();
  // The error of the pose may be far larger than the covariance says: the pose is preliminary, its
  // confidence is below .9, its position sigma without scale drift exceeds a tenth of the depth,
  // dead reckoning has lasted .2 s, or few landmarks connect this part of the map with the rest.
  // The flag is cleared when the camera sees a known part of the map again.
  bool is_uncertain = false;
  double confidence = 0;  // probability that the pose is right (RelocalizationResult)
  // During dead reckoning (kOdometry): seconds since the map last gave a pose; else 0.
  double seconds_without_map = 0;
  // The focal length of the image, divided by that of the camera that was given: 1 unless the lens
  // was seen to change (a zoom, autofocus, another lens).
  double focal_ratio = 1;
  // Median depth of what supports the pose, map units: of landmarks, of the objects in the image,
  // or of the points that the odometry follows; 0 where none is known.
  double depth = 0;
  // The length of the odometry's unit in map units; the odometry is ImageInput::motion where that
  // was given, else Slam's own. Nothing as long as the length is not known.
  std::optional<double> motion_unit;

  // Number of key points of the image; 0 where the pose is by dead reckoning and none were
  // extracted.
  int keypoints = 0;
  // Landmarks found in the image, and those of them that agree with the pose; nothing where none
  // were looked for.
  std::optional<int> matched, inliers;
  // `detections`: all of this image; `objects`: mapped objects seen in it.
  int detections = 0, objects = 0;
  double ms_total = 0, ms_features = 0, ms_track = 0, ms_objects = 0;
  double cpu_ms = 0;  // CPU time from image in to pose out; mapping not counted

  // Replaces the pose by the camera's pose in another world, and clears the numbers of landmarks
  // and the motion unit, which were of the former world.
  void GoTo(const PoseElsewhere& there) {
    world = there.world;
    state = there.state;
    world_from_cam_ = there.world_from_cam;
    source = PoseSource::kMap;
    covariance = there.covariance;
    is_uncertain = there.is_uncertain;
    confidence = there.confidence;
    depth = there.depth;
    seconds_without_map = 0;
    motion_unit.reset();
    matched.reset();
    inliers.reset();
  }
  // Multiplies all lengths by `factor`, after the unit of the map has changed.
  void ScaleLengths(double factor) {
    if (world_from_cam_) world_from_cam_->translation *= factor;
    depth *= factor;
    if (motion_unit) *motion_unit *= factor;
    covariance = WithScaledLengths(covariance, factor);
  }

 private:
  std::optional<Rigid3> world_from_cam_;
};

}  // namespace oaslam
