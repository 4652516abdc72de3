#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/class_relations.h"
#include "oaslam/features/features.h"
#include "oaslam/ids.h"
#include "oaslam/map/anchor.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/label_shares.h"
#include "oaslam/map/table.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// Least number of common landmarks that joins two keyframes in the covisibility graph.
constexpr int kMinSharedLandmarks = 15;

struct Covisible {
  KeyframeId keyframe;
  int shared = 0;  // landmarks seen by both
  bool operator==(const Covisible&) const = default;
};

// The motion of the camera from another keyframe to a keyframe, by its images alone (odometry).
struct KeyframeMotion {
  KeyframeId from;
  Rigid3 cam_from_cam;                            // this keyframe's camera from the other's
  double sigma_position = 0, sigma_rotation = 0;  // standard deviations; rotation in rad
  double metres = 0;          // the length of the motion by an IMU or a depth camera; 0: not known
  double relative_sigma = 0;  // standard deviation of `metres`, divided by it

  bool IsMetric() const { return metres > 0; }
  // `metres` stays: what changes is the unit of the map.
  void Scale(double factor) {
    cam_from_cam.translation *= factor;
    sigma_position *= factor;
  }
};

// FrameMotion::run and scale_drift of an image.
struct ScaleDrift {
  int run = 0;
  double variance = 0;
};

struct Keyframe {
  int frame_index = 0;
  double timestamp = 0;
  int camera = 0;  // index into Map::cameras
  Rigid3 cam_from_world;
  std::shared_ptr<const Features> features;
  std::vector<LandmarkId> landmarks;                // by key point; invalid where there is none
  std::vector<Covisible> covisible;                 // most shared landmarks first, then by id
  std::optional<Eigen::Vector3d> gravity_in_cam{};  // measured, any length; not saved
  std::optional<KeyframeMotion> motion{};           // not saved
  std::optional<ScaleDrift> scale_drift{};          // not saved
  // As Frame::image, until the key points have learned descriptors; not saved.
  std::shared_ptr<const GreyBuffer> image{};
  // By entry of features->learned: z in the camera of a point that has no landmark, map units; 0
  // where there is none.
  std::vector<float> learned_depths{};
  // By key point, in metres; z is 0 where none was measured, and all are absent without a depth
  // camera. Not saved.
  std::vector<MeasuredDepth> depths{};
  // The product of the factors by which loops have multiplied the lengths around the keyframe. Not
  // saved.
  double unit = 1;

  // Whether each described key point exists and has a descriptor and a depth, and the key points
  // ascend without repeats.
  bool HasSoundLearned() const;
  // Multiplies all lengths except positions in the world.
  void ScaleLengths(double factor) {
    if (motion) motion->Scale(factor);
    for (float& depth : learned_depths) depth *= static_cast<float>(factor);
  }
};

// A keyframe that was culled: poses that are relative to it are resolved through another keyframe.
struct RetiredKeyframe {
  KeyframeId parent;
  Rigid3 cam_from_parent;
  double unit = 1;  // as Keyframe::unit
};

struct Observation {
  KeyframeId keyframe;
  uint32_t keypoint = 0;
  bool operator==(const Observation&) const = default;
};

struct Landmark {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world
  // Mean unit direction from camera centres to the point.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  Descriptor descriptor{};                   // of the observation closest to all others
  float min_distance = 0, max_distance = 0;  // range in which the pyramid can detect it
  KeyframeId first_keyframe;                 // the newest keyframe at its creation
  int visible = 1, found = 1;             // number of frames that should have seen it, and that did
  std::vector<Observation> observations;  // ascending by keyframe
};

// Tentative: it has boxes only. Initialized: it has an ellipsoid, which is not accepted yet.
// Mapped: the ellipsoid is accepted.
enum class ObjectState { kTentative, kInitialized, kMapped };

// "tentative", "initialized" or "mapped", as in files.
const char* ToString(ObjectState state);

struct ObjectObservation {
  int frame_index = 0;
  KeyframeId reference;  // keyframe that the pose is relative to
  Rigid3 cam_from_reference;
  int camera = 0;  // index into Map::cameras
  Box box;         // ideal image
  double score = 0;
  unsigned char truncated = 0;  // EdgeBits
  double weight = 1;  // the number of detections of a 30 Hz video it counts for; not saved
  // The z of the surface that the box shows, by a depth camera, map units; 0: not known; not saved.
  double surface = 0;

  void ScaleLengths(double factor) {
    cam_from_reference.translation *= factor;
    surface *= factor;
  }
};

struct Object {
  int category_id = 0;  // the commonest of its labels
  LabelShares shares;   // of its labels
  std::string name;     // given by the user; empty: the name of its class is used
  ObjectState state = ObjectState::kTentative;
  // World frame. Of a tentative object that is known_by_landmarks, it tells where the landmarks
  // are; of other tentative objects it has no meaning.
  Ellipsoid ellipsoid;
  // Center, log half axes, yaw about up.
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  double detection_rate = 0.9;  // P_D: share of frames in view that detected it
  double mean_iou = 0;          // of projection and box over its own untruncated observations
  int total_observations = 0;   // also those not kept
  double evidence = 0;          // sum of the weights of all observations; not saved
  int last_seen_frame = 0;
  std::optional<double> last_seen_time{};  // seconds; nothing: not seen since the map was loaded
  // Evidence in nats that it is no longer in its place (objects/presence.h); not saved.
  double absence = 0;
  int misses = 0;           // successive frames that should have shown it and did not; not saved
  bool was_mapped = false;  // it was mapped before its observations contradicted it; not saved
  bool has_moved = false;   // since the map was made or loaded
  std::vector<ObjectObservation> observations;  // ascending by frame; thinned
  std::vector<LandmarkId> landmarks;     // ascending; landmarks of key points inside its boxes
  std::vector<uint16_t> landmark_votes;  // parallel: how often each was inside
  // It is not mapped, but has enough landmarks to be recognized by them. Not saved.
  bool known_by_landmarks = false;
};

// The evidence for the metre where the user did not give it.
struct UnitEvidence {
  double relative_sigma = 0;     // standard deviation of the metre, divided by it
  int objects = 0, classes = 0;  // that agreed; 0 unless it follows from objects
  UnitSource source = UnitSource::kObjects;

  bool operator==(const UnitEvidence&) const = default;
};

// The map is a value: a copy is a snapshot (Table). Only the mapper writes to it; every edit keeps
// both sides of an observation consistent. The world frame is the odometry's, or else that of the
// first keyframe; the unit is arbitrary (monocular) unless the map was scaled.
struct Map {
  std::vector<Camera> cameras;
  Table<KeyframeId, Keyframe> keyframes;
  Table<KeyframeId, RetiredKeyframe> retired;
  Table<LandmarkId, Landmark> landmarks;
  Table<ObjectId, Object> objects;
  // From an erased duplicate to the object that took its observations.
  Table<ObjectId, ObjectId> merged_objects;
  std::optional<Eigen::Vector3d> up;  // world direction against gravity, once known
  // The number of keyframes whose measured gravity determined `up`; 0: it follows from how the
  // camera was held.
  int up_keyframes = 0;
  uint64_t version = 0;    // of the snapshot
  int loops_closed = 0;    // since the map was made or loaded
  bool is_metric = false;  // the unit is the metre; else arbitrary
  // Of a metric map: the evidence for its metre; nothing where the user gave the metre.
  std::optional<UnitEvidence> unit_evidence{};
  // Whether the user, or what he did before, made the map metric. A sensor would tell the metre of
  // any other map as well.
  bool IsMetricByUser() const {
    return is_metric && !(unit_evidence && unit_evidence->source != UnitSource::kObjects);
  }
  ClassRelations classes;                 // which classes move, and which are parts of which
  std::map<std::string, Anchor> anchors;  // by name

  uint32_t next_landmark = 0;

  // Resolves a keyframe that a pose is relative to: to itself while it is in the map, and to the
  // keyframe that carries its pose since it was retired. Nothing if the keyframe was never in the
  // map.
  struct Carried {
    KeyframeId by;
    Rigid3 cam_from_carrier;
  };
  std::optional<Carried> ResolveKeyframe(KeyframeId id) const;
  // The pose of a keyframe that is, or was, in the map.
  std::optional<Rigid3> ResolvePose(KeyframeId id) const;
  // The present id of an object, which may have been merged into another;
  // nothing if it was dropped.
  std::optional<ObjectId> ResolveObject(ObjectId id) const;

  // The index of a camera of the map in `cameras`.
  int IndexOf(const Camera& camera) const;
  bool HasCamera(const Camera& camera) const;
  // As IndexOf, for any camera: adds one that is not in `cameras`.
  int AddCamera(const Camera& camera);

  LandmarkId AddLandmark(const Eigen::Vector3d& position, KeyframeId first_keyframe);
  // No-op if the keyframe sees this landmark already, or the key point is taken.
  bool AddObservation(LandmarkId landmark, KeyframeId keyframe, uint32_t keypoint);
  // Erases the landmark too when fewer than two observations remain.
  void EraseObservation(LandmarkId landmark, KeyframeId keyframe);
  void EraseLandmark(LandmarkId landmark);
  // The observations of `from` that `to` lacks move to `to`; `from` is erased.
  void MergeLandmarks(LandmarkId from, LandmarkId to);
  // Erases a keyframe; it stays resolvable through its most covisible neighbour.
  void RetireKeyframe(KeyframeId id);

  // Drops the key points of a keyframe that show no landmark.
  void DropFreeKeypoints(KeyframeId id);

  // Computes descriptor, normal and distance range from the observations. To be called after
  // observations or poses have changed.
  void UpdateLandmark(LandmarkId id);
  void UpdateLandmarkGeometry(LandmarkId id);  // normal and range only
  // Computes the covisibility of a keyframe from its landmarks; updates the lists of its
  // neighbours, too.
  void UpdateCovisibility(KeyframeId id, int min_shared = kMinSharedLandmarks);

  // The up to `count` most covisible keyframes.
  std::vector<KeyframeId> CovisibleKeyframes(KeyframeId id, int count) const;
  // The up to `count` most covisible keyframes, and last the keyframe itself.
  std::vector<KeyframeId> KeyframesAround(KeyframeId id, int count) const;
  // The keyframe whose camera was nearest to a place; invalid in an empty map.
  KeyframeId NearestKeyframe(const Eigen::Vector3d& place) const;
  // The number of key points of the keyframe whose landmark has at least
  // `min_observations` observations.
  int CountTrackedLandmarks(KeyframeId id, int min_observations) const;
  // The number of objects that are mapped.
  int CountMappedObjects() const;
  // Median depth of the landmarks `ids`; those no longer in the map do not count; 0 without any.
  double MedianDepth(const Rigid3& cam_from_world, std::span<const LandmarkId> ids) const;
  double MedianDepth(KeyframeId id) const;  // of the landmarks that it sees

  // Multiplies all lengths: one old unit is `factor` new ones.
  void Scale(double factor);

  // Describes every violated invariant of the tables, one line each; empty when
  // the map is consistent.
  std::vector<std::string> CheckInvariants() const;
};

// The pose of a frame, relative to a keyframe.
struct FramePose {
  int frame_index = 0;
  double timestamp = 0;
  KeyframeId reference;
  Rigid3 cam_from_reference;
  TrackingState state = TrackingState::kTracking;
};

}  // namespace oaslam
