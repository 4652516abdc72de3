#pragma once

#include <optional>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/ids.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// What a pose rests on. kMap: landmarks were looked for in the image; kMotion: the camera's motion
// since the map gave its pose, up to some tenths of a second before, or while the state is
// kOdometry; kObjects: mapped objects in the image; kRegistration: the camera's motion, placed by
// several images around it that were found by objects or points; kNone: there is no pose.
enum class PoseSource { kNone, kMap, kMotion, kObjects, kRegistration };

// "none", "map", "motion", "objects", "registration".
OASLAM_API const char* ToString(PoseSource source);

// The camera's pose in a world other than TrackingResult::world, in the units of that world.
struct PoseElsewhere {
  WorldId world;
  TrackingState state = TrackingState::kLost;
  Rigid3 world_from_cam;
  // In a world that was joined, that of the pose in TrackingResult::world: how well the two are
  // known to lie to each other (mostly to some percent of the distance) is not in it.
  PoseCovariance covariance = PoseCovariance::Zero();
  bool is_uncertain = false;
  double confidence = 0;  // probability that the pose is right
  double depth = 0;       // median depth of what supports the pose; 0 without any

  // Multiplies all lengths, as those of the world were.
  void ScaleLengths(double factor) {
    world_from_cam.translation *= factor;
    depth *= factor;
    covariance = WithScaledLengths(covariance, factor);
  }
};

// The tracking result of one image.
struct TrackingResult {
  int frame = 0;  // counted from 0 since the start, Load or Reset; -1: no image yet
  double timestamp = 0;
  TrackingState state = TrackingState::kLost;
  // The world of the map, in which the pose is. It changes where a lost camera goes on in another
  // submap, which may be joined with the first once that is seen again (not while a map was
  // loaded, has anchors or is in metres); where the map is joined with one that is in metres; and
  // by SetMetresPerUnit, Load and Reset. Content in coordinates of an application's own belongs to
  // the world in which it was made; anchors (PlaceAnchor) move with their map.
  WorldId world;

  // world_from_cam: the camera's pose in a world, in map units (OpenCV axes: x right, y down, z
  // forward). Nothing where the camera has none in that world.
  std::optional<Rigid3> PoseIn(WorldId asked) const {
    if (asked == world) return world_from_cam_;
    for (const PoseElsewhere& other : elsewhere)
      if (other.world == asked) return other.world_from_cam;
    return std::nullopt;
  }
  // Its pose in each world that the application was told of and whose map was joined with this one,
  // as these lay to each other when they were joined: what was made there keeps its place. And
  // while another submap grows, since the camera was lost in `world`: its pose in the world of
  // that, as soon as it is tracked there; the last one.
  std::vector<PoseElsewhere> elsewhere;
  // Whether the camera has a pose in `world`.
  bool HasPose() const { return world_from_cam_.has_value(); }
  // Sets or removes the pose, in `world`.
  void SetPose(const std::optional<Rigid3>& world_from_cam) { world_from_cam_ = world_from_cam; }

  PoseSource source = PoseSource::kNone;
  // PoseCovariance says its frame and axes. 0 without a pose. What a loop will correct is in it as
  // far as the odometry knows how well it holds the scale (docs/lab/uncertainty.md).
  PoseCovariance covariance = PoseCovariance::Zero();
  // The pose may be off by far more than the covariance says: it is preliminary, its confidence is
  // below .9, its sigma without what the scale may have lost a tenth of the depth, the motion alone
  // has carried it on for .2 s, or it is in a part of the map that hardly anything ties to the
  // rest. That ends where the camera sees again what it saw before.
  bool is_uncertain = false;
  double confidence = 0;  // probability that the pose is right (RelocalizationResult)
  // While the camera's motion carries the pose on (kOdometry): seconds since the map gave it; else
  // 0.
  double seconds_without_map = 0;
  // Median depth of what supports the pose, map units: of landmarks, of the objects in the image,
  // or of the points that the odometry follows; 0 where none is known.
  double depth = 0;
  // The length of the odometry's unit in map units: of ImageInput::motion where it was given, else
  // of Slam's own. Nothing as long as it is not known.
  std::optional<double> motion_unit;

  int keypoints = 0;  // of the image; 0 where none were needed, as it was carried by the motion
  // Landmarks found in the image, and those of them that agree with the pose; nothing where none
  // were looked for.
  std::optional<int> matched, inliers;
  // `detections`: all of this image; `objects`: mapped objects seen in it.
  int detections = 0, objects = 0;
  double ms_total = 0, ms_features = 0, ms_track = 0, ms_objects = 0;
  double cpu_ms = 0;  // CPU time from image in to pose out; mapping not counted

  // Makes this the result of another world, in which the camera has a pose, too. What landmarks
  // and motion tell of the former one goes.
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
  // Multiplies all lengths, as those of the map were.
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
