#include <algorithm>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/motion_sigmas.h"
#include "oaslam/mapping/local_mapping.h"

namespace oaslam {
namespace {

Keyframe MakeKeyframe(const Frame& frame, const Rigid3& cam_from_world, Map& map) {
  Keyframe keyframe;
  keyframe.frame_index = frame.index;
  keyframe.timestamp = frame.timestamp;
  keyframe.camera = map.AddCamera(*frame.camera);
  keyframe.cam_from_world = cam_from_world;
  keyframe.features = frame.features;
  keyframe.gravity_in_cam = frame.gravity_in_cam;
  keyframe.image = frame.image;
  if (frame.motion && frame.motion->scale_drift)
    keyframe.scale_drift = {frame.motion->run, *frame.motion->scale_drift};
  keyframe.landmarks.resize(frame.features->keypoints.size());
  if (frame.depth)
    for (const Keypoint& keypoint : frame.features->keypoints)
      keyframe.depths.push_back(frame.depth->At(Distort(*frame.camera, keypoint.px.cast<double>()))
                                    .value_or(MeasuredDepth{}));
  return keyframe;
}

// The motion by the odometry; where the depths were not measured, the distance of the two cameras
// is 1.
KeyframeMotion MotionOf(const InitialMap& initial, double depth) {
  Rigid3 motion = initial.motion;
  if (!initial.is_measured) motion.translation.normalize();
  const double turn = Eigen::AngleAxisd(Eigen::Quaterniond(motion.rotation)).angle(),
               way = initial.is_measured ? motion.translation.norm() : 1;
  return {initial.first_id, motion, kSigmaOfWay * way + kSigmaOfDepthIfYoung * depth,
          kSigmaOfTurn * turn + kLeastTurn};
}

}  // namespace

bool InsertInitialMap(const InitialMap& initial, Map& map) {
  constexpr int kIterations = 20;          // two views start far from the minimum
  constexpr size_t kFewestLandmarks = 15;  // tracking needs 15 inliers (TrackDemands)
  Map fresh;
  fresh.cameras = map.cameras;
  fresh.version = map.version;
  fresh.next_landmark = map.next_landmark;
  fresh.classes = map.classes;
  fresh.keyframes.Insert(initial.first_id, MakeKeyframe(initial.first, {}, fresh));
  fresh.keyframes.Insert(initial.second_id,
                         MakeKeyframe(initial.second, initial.second_from_first, fresh));
  for (const InitialPoint& point : initial.points) {
    const LandmarkId id = fresh.AddLandmark(point.position, initial.second_id);
    fresh.AddObservation(id, initial.first_id, point.first_keypoint);
    fresh.AddObservation(id, initial.second_id, point.second_keypoint);
    fresh.UpdateLandmark(id);
  }
  fresh.UpdateCovisibility(initial.second_id, 1);
  // Two views alone take a turn for a way: the odometry knows their motion from all images between.
  const double baseline = initial.motion.translation.norm();
  fresh.keyframes.MutableAt(initial.second_id).motion =
      MotionOf(initial, fresh.MedianDepth(initial.second_id));
  if (!initial.is_measured)
    ApplyCorrection(GlobalBundleAdjustment(fresh, kIterations, BundleConfig{}), fresh);
  if (fresh.MedianDepth(initial.first_id) <= 0 ||
      fresh.landmarks.size() < std::max(kFewestLandmarks, initial.points.size() / 2))
    return false;
  Rigid3 second_from_first = fresh.keyframes.At(initial.second_id).cam_from_world;
  const double scale = initial.is_measured ? 1 : baseline / second_from_first.translation.norm();
  second_from_first.translation *= scale;
  const Rigid3 first_from_world = second_from_first.Inverse() * initial.second_from_world;
  const Rigid3 world_from_first = first_from_world.Inverse();
  for (const KeyframeId id : fresh.keyframes.Ids()) {
    Rigid3& pose = fresh.keyframes.MutableAt(id).cam_from_world;
    pose.translation *= scale;
    pose = pose * first_from_world;
  }
  if (!initial.is_measured) fresh.keyframes.MutableAt(initial.second_id).motion->Scale(baseline);
  for (const LandmarkId id : fresh.landmarks.Ids()) {
    Eigen::Vector3d& position = fresh.landmarks.MutableAt(id).position;
    position = world_from_first * (scale * position).eval();
  }
  for (const LandmarkId id : fresh.landmarks.Ids()) fresh.UpdateLandmark(id);
  fresh.UpdateCovisibility(initial.second_id, 1);
  map = std::move(fresh);
  return true;
}

std::vector<LandmarkId> CorrectMotions(
    KeyframeId right_until, std::span<const std::pair<KeyframeId, KeyframeMotion>> motions,
    Map& map) {
  // A submap that was joined since has later ids, and earlier images.
  const Keyframe* last_right = map.keyframes.Find(right_until);
  const int right_frame = last_right ? last_right->frame_index : -1;
  std::vector<KeyframeId> moved = map.keyframes.Ids();
  std::erase_if(moved, [&](KeyframeId id) {
    return id <= right_until || map.keyframes.At(id).frame_index <= right_frame;
  });
  std::optional<Rigid3> new_from_old;  // of the keyframe before, in the world
  for (const KeyframeId id : moved) {
    const auto known =
        std::ranges::find(motions, id, &std::pair<KeyframeId, KeyframeMotion>::first);
    const auto from = known == motions.end() ? std::nullopt : map.ResolvePose(known->second.from);
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    const Rigid3 old = keyframe.cam_from_world;
    if (from)
      keyframe.cam_from_world = known->second.cam_from_cam * *from;
    else if (new_from_old)
      keyframe.cam_from_world = old * new_from_old->Inverse();
    new_from_old = keyframe.cam_from_world.Inverse() * old;
  }
  for (const LandmarkId id : map.landmarks.Ids()) {
    const KeyframeId first = map.landmarks.At(id).first_keyframe;
    if (right_until < first &&
        (!map.keyframes.Contains(first) || std::ranges::binary_search(moved, first)))
      map.EraseLandmark(id);
  }
  for (const KeyframeId id : moved) map.UpdateCovisibility(id);
  std::vector<LandmarkId> made;
  for (const KeyframeId id : moved) {
    const std::vector<LandmarkId> here = TriangulateNewLandmarks(id, map);
    made.insert(made.end(), here.begin(), here.end());
  }
  return made;
}

void InsertKeyframe(const KeyframeInsertion& insertion, Map& map) {
  const TrackedFrame& tracked = insertion.frame;
  const auto reference = map.ResolvePose(tracked.reference);
  const Rigid3 pose = reference ? tracked.cam_from_reference * *reference : tracked.cam_from_world;
  map.keyframes.Insert(insertion.id, MakeKeyframe(tracked.frame, pose, map));
  // After a loop, which has scaled the map, they come again with a later keyframe.
  if (insertion.loops_closed == map.loops_closed)
    for (const auto& [id, motion] : insertion.motions)
      if (Keyframe* keyframe = map.keyframes.Mutable(id)) keyframe->motion = motion;
  for (uint32_t i = 0; i < tracked.landmarks.size(); ++i)
    if (tracked.landmarks[i].IsValid() && map.AddObservation(tracked.landmarks[i], insertion.id, i))
      map.UpdateLandmark(tracked.landmarks[i]);
  map.UpdateCovisibility(insertion.id);
}

void CountLandmarkUse(std::span<const LandmarkUse> uses, Map& map) {
  for (const LandmarkUse& use : uses)
    if (Landmark* landmark = map.landmarks.Mutable(use.landmark)) {
      landmark->visible += use.visible;
      landmark->found += use.found;
    }
}

}  // namespace oaslam
