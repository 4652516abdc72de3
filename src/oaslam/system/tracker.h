#pragma once

#include <algorithm>
#include <climits>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/localization/relocalizer.h"
#include "oaslam/map/frame_view.h"
#include "oaslam/map/map.h"
#include "oaslam/map/next_ids.h"
#include "oaslam/map/piece.h"
#include "oaslam/objects/association.h"
#include "oaslam/pieces/piece_link.h"
#include "oaslam/system/mapper.h"
#include "oaslam/system/odometry_registration.h"
#include "oaslam/tracking/initializer.h"
#include "oaslam/tracking/map_drift.h"
#include "oaslam/tracking/pose_tracking.h"
#include "oaslam/tracking/trajectory.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Over so long the odometry's unit is averaged: its scale drifts slowly.
inline constexpr double kUnitSeconds = 10;

// The length of the odometry's unit in units of the map.
struct OdometryUnit {
  int run = 0;    // FrameMotion::run
  int loops = 0;  // closed in the map: each may have changed its scale
  double length = 1;
  double seconds = 0;  // over which it was averaged
  // How far the lengths of single images are off, relative: how well the odometry and the map hold
  // their scales in this film. Begins as a guess that counts as a second of images.
  double spread = 0.03, spread_seconds = 1;
};

// The error of a position that nothing tells but a hand's usual way in a tenth of a second, as a
// share of the depth: a guess.
inline constexpr double kUnknownWay = 0.03;

// A pose by the camera's motion since the map was last seen.
struct OdometryPrediction {
  ExpectedPose expected;
  KeyframeId reference;
  bool is_turn = false;  // how far the camera has moved is not known
};

// Follows the camera from frame to frame on snapshots of the map, and tells the mapper what to add.
class Tracker {
 public:
  struct Outcome {
    TrackingState state = TrackingState::kLost;
    std::optional<Rigid3> cam_from_world;
    int matched = 0, inliers = 0;
    // Number of mapped objects seen.
    int objects = 0;
    double confidence = 0;  // [0, 1], of the pose
    PoseCovariance covariance = PoseCovariance::Zero();
    bool is_uncertain = false;
    double seconds_without_map = 0;
    double depth = 0;  // median depth of the landmarks that support the pose, map units
    double ms_objects = 0;
    // The pose by objects of a camera that is lost, and any while another piece grows. Frames with
    // a pose in two pieces of map tell how the pieces lie to each other (PieceLink).
    std::optional<Relocalization> located;
    std::optional<MapCommand> command;
    // `command` holds an initial map: the caller must hand it to the mapper and then call
    // AdoptInitialMap with the map that results.
    bool map_required = false;
    bool is_urgent = false;  // the next frame must see a map that contains the command
    bool is_keyframe = false;
    // The camera is lost and the map is too small to find it again: the caller should begin a new
    // tracker with an empty map.
    bool gives_up = false;

    static Outcome Tracked(TrackingState state, const Rigid3& cam_from_world, int matched,
                           int inliers);
    static Outcome ByObjects(const ExpectedPose& pose, double confidence);
  };

  // With fewer landmarks in view, the camera may soon be lost, and the pose is strengthened by
  // matches of all key points with the last image.
  static constexpr int kFewLandmarks = 200;
  // The smallest search radius about a prediction, pixels of the lowest level.
  static constexpr double kMotionWindow = 15;

  // `map_is_loaded`: the tracker begins as lost in a map that exists already, and does not
  // initialise one. `ids`: those of its first keyframe and object.
  Tracker(const SlamConfig& config, const NextIds& ids, bool map_is_loaded);

  void SetRelocalizationMode(RelocalizationMode mode) { relocalization_mode_ = mode; }
  // Without mapping the map is only read: no keyframes, no objects, no new map.
  void SetMapping(bool enabled) { mapping_ = enabled; }

  // Uses an index of the map that was made elsewhere, to find a lost camera.
  void Use(std::shared_ptr<const LandmarkIndex> index) { relocalizer_.Use(std::move(index)); }

  // As Atlas::NeedsFeatures.
  bool NeedsFeatures(double timestamp, const FrameMotion* motion) const;
  Outcome Track(const Frame& frame, const Map& map);
  // Records a frame without looking for the lost camera in it.
  Outcome PassOver(const Frame& frame, const Map& map);
  // Takes over the initial map that Track asked for, or continues to initialise where the mapper
  // refused it.
  Outcome AdoptInitialMap(const Frame& frame, const Map& map);

  // Detections of a frame that was given without them (Frame::detections_follow). If the frame has
  // a pose, they are associated with objects at its present pose. If the camera was lost in it and
  // still is, they relocalize the frame, and tracking continues from there. Frames ascend. Returns
  // nothing where the frame is too old.
  std::optional<Outcome> AddDetections(int frame_index, std::vector<ObjectDetection> detections,
                                       const Map& map);

  // Continues with the state of another tracker, whose map was joined with this one's and scaled by
  // `scale`; the poses of its frames are added to this trajectory.
  void GoOnAs(Tracker other, double scale);
  // Takes over the poses of a piece that was joined with the map and scaled by `scale`, for frames
  // that have no pose by points here. Its ids are in use from now on.
  void Adopt(const Piece& piece, double scale);
  // The first ids that neither the tracker nor its newest map uses.
  NextIds FreeIds(const Map& newest) const {
    return {next_keyframe_, newest.next_landmark, object_tracks_.next_object};
  }

  // While another piece of map grows, which may be joined with this one, there are no keyframes,
  // and images in which the camera was lost get no pose by its motion.
  void SetAnotherGrows(bool grows) { another_grows_ = grows; }
  // New objects get ids that another tracker has not given.
  void SkipObjectsOf(const Tracker& other) {
    object_tracks_.next_object =
        std::max(object_tracks_.next_object, other.object_tracks_.next_object);
  }

  // Whether a frame has a pose by points.
  bool HasTracked(int frame_index) const;
  // cam_from_world of a frame, or nothing where it has no pose.
  std::optional<Rigid3> PoseOf(int frame_index, const Map& map) const;
  int newest_frame() const { return newest_.frame.index; }
  // How many points the newest frame has, with or without a landmark.
  int newest_features() const {
    return newest_.frame.features ? newest_.frame.features->size() : 0;
  }
  // What a viewer shows of the newest frame; the caller adds the map.
  FrameView View() const;
  // Makes the tracker lose its pose, if it has one: the next frame is relocalized. `near`: where
  // the camera may be, world_from_cam; it is looked for there first until it is found.
  void ForceRelocalization(const std::optional<Rigid3>& near);
  // Continues in the same map after all of its lengths were multiplied by `factor`.
  void Scale(double factor);

  // The outcome of the newest frame, computed again with `map`; lost where the frame is not
  // tracked.
  Outcome Present(const Map& map);

  bool IsInitializing() const { return phase_ == Phase::kInitializing; }
  // While it is initialising: why there is no map yet.
  const std::string& why_no_map() const { return initializer_.why_not(); }
  bool IsMapping() const { return mapping_; }
  // Removes and returns the observations of landmarks and objects since the last command.
  MapCommand TakeRest();
  // Poses of all frames so far, relative to keyframes of the map or retired ones.
  const std::vector<FramePose>& trajectory() const { return trajectory_.poses(); }
  // Refines the poses of frames that are not refined yet against the finished map.
  void RefineTrajectory(const Map& map) { trajectory_.RefinePosesBefore(map, INT_MAX); }

 private:
  void Take(const Frame& frame);
  enum class Phase { kInitializing, kTracking, kLost };

  static TrackedFrame Placed(const Frame& frame, const Map& map, const TrackReport& tracked);
  // cam_from_reference of a pose.
  static Rigid3 RelativeTo(const Map& map, KeyframeId reference, const Rigid3& cam_from_world) {
    return cam_from_world * map.keyframes.At(reference).cam_from_world.Inverse();
  }
  static Outcome WithoutMap(const FrameMotion* motion);
  Outcome Initialize(const Frame& frame, const Map& map);
  Outcome Relocalize(const Frame& frame, const Map& map);
  Outcome Carry(const Frame& frame, const Map& map, const OdometryPrediction& predicted);
  std::optional<Outcome> RegisterAgain(const Frame& frame, const Map& map);
  Relocalization Find(const Frame& frame, const Map& map);
  TrackReport TrackFound(const Frame& frame, const Map& map, const Relocalization& found) const;
  Outcome PlaceLost(const Frame& frame, const Map& map, const Relocalization& found);
  Outcome Continue(const Frame& frame, const Map& map, const TrackReport& tracked,
                   TrackingState state);
  Outcome ReportObjectPose(const Frame& frame, const Map& map, const Relocalization& found);
  Outcome ShowPose(const Frame& frame, const Map& map, const ExpectedPose& pose, double confidence);
  TrackDemands Demands() const;
  Outcome OutcomeOf(const Frame& frame, const Map& map, const TrackReport& tracked,
                    TrackingState state);
  TrackReport FollowWithoutMotion(const Frame& frame, const Map& map) const;
  struct CameraMotion {
    Rigid3 cam_from_cam;
    double sigma_position = 0, sigma_rotation = 0;
    bool is_turn = false;  // how far the camera has moved is not known
  };
  std::optional<CameraMotion> MotionBetween(const std::shared_ptr<const FrameMotion>& before,
                                            const std::shared_ptr<const FrameMotion>& now,
                                            const FrameMotion& newest) const;
  std::optional<CameraMotion> MotionSince(const std::shared_ptr<const FrameMotion>& before,
                                          const Frame& frame) const;
  std::optional<OdometryPrediction> PredictByOdometry(const Frame& frame, const Map& map) const;
  TrackReport FollowByOdometry(const Frame& frame, const Map& map,
                               const OdometryPrediction& predicted);
  TrackReport StrengthenedInLocalMap(const Frame& frame, const Map& map, const TrackReport& first,
                                     const TrackDemands& demands) const;
  std::vector<std::pair<KeyframeId, KeyframeMotion>> MotionsToKeyframes(const Frame& frame) const;
  void LearnUnit(const Frame& frame, const Map& map, const TrackReport& tracked);
  static Rigid3 CorrectedPose(const FrameMotion& image, const std::vector<Frame>& frames,
                              const FrameMotion& now);
  void FillInBeforeMap(const std::vector<Frame>& frames, const Map& map);
  Outcome Lose(const Frame& frame, const Map& map);
  Outcome ByRegistration(const Frame& frame, const Map& map);
  void AddToRegistration(const Frame& frame, const Map& map, const Relocalization& found);
  void KeepLost(const Frame& frame);
  void FillInLost(const Frame& frame, const Map& map, const TrackReport& tracked);
  void Remember(const Frame& frame, const Map& map, const TrackReport& tracked,
                TrackingState state);
  void MakeKeyframe(const Frame& frame, const Map& map, const TrackReport& tracked,
                    Outcome& outcome);
  void ObserveObjects(const Frame& frame, const Map& map, const TrackReport& tracked,
                      Outcome& outcome);
  int Associate(const TrackedFrame& seen, const Map& map);

  // The newest frame with a pose and features.
  struct Last {
    Frame frame;
    std::vector<LandmarkId> landmarks;
    KeyframeId reference;
    Rigid3 cam_from_reference;
    PoseCovariance covariance;  // given the landmarks
  };

  // An image with a known place in the map, from which the camera's motion is added up.
  struct OdometryAnchor {
    std::shared_ptr<const FrameMotion> motion;
    KeyframeId reference;
    Rigid3 cam_from_reference;
  };

  struct LostImage {
    int frame_index = 0;
    double timestamp = 0;
    std::shared_ptr<const FrameMotion> motion;
  };

  SlamConfig config_;
  Initializer initializer_;
  Relocalizer relocalizer_;
  ObjectTrails object_trails_;  // while the camera is lost, without mapping
  RelocalizationMode relocalization_mode_ = RelocalizationMode::kPointsAndObjects;
  Rng rng_;
  Phase phase_ = Phase::kInitializing;
  bool map_is_loaded_;
  bool mapping_ = true, another_grows_ = false;
  uint32_t next_keyframe_;
  FrameView newest_;  // without map, pose and objects
  std::optional<Last> last_;
  std::vector<LostImage> lost_images_;  // since the camera was last tracked
  // The newest one first in the map is used: a keyframe is not yet in it.
  std::vector<OdometryAnchor> anchors_;
  std::optional<OdometryUnit> unit_;
  OdometryRegistration registration_;  // of a lost camera, by objects
  // Of the newest keyframes, ascending.
  std::vector<std::pair<KeyframeId, std::shared_ptr<const FrameMotion>>> keyframe_motions_;
  double map_began_time_ = -INFINITY;
  double seen_in_map_time_ = -INFINITY;  // of the newest frame whose pose the map gave
  double depth_ = 0;                     // median, of that frame
  double looked_in_map_time_ = 0;        // without mapping, while the odometry carries the pose on
  bool view_has_changed_ = false;        // since the newest keyframe, as the odometry sees it
  KeyframeId newest_keyframe_;
  double newest_keyframe_time_ = 0;
  int newest_keyframe_inliers_ = 0;
  // By the user (ForceRelocalization): the last pose does not predict the next.
  bool is_pose_doubted_ = false;
  std::optional<Rigid3> prior_;  // from the user, world_from_cam, while the camera is lost
  MapDrift drift_;
  Parting parting_;
  double seen_confidence_ = 0;     // of the newest pose that the map gave
  double usual_spread_ = 0;        // of the landmarks in the image, over the last seconds
  std::vector<LandmarkUse> uses_;  // since the newest keyframe
  ObjectTracks object_tracks_;
  std::vector<ObjectSighting> sightings_;  // since the newest keyframe
  // Frames whose detections have not arrived yet, ascending; without pose: `reference` is invalid.
  std::deque<TrackedFrame> undetected_;
  Trajectory trajectory_;
};

}  // namespace oaslam
