#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame_view.h"
#include "oaslam/map/map.h"
#include "oaslam/objects/association.h"
#include "oaslam/system/mapper.h"
#include "oaslam/system/piece_link.h"
#include "oaslam/system/relocalizer.h"
#include "oaslam/tracking/initializer.h"
#include "oaslam/tracking/pose_tracking.h"
#include "oaslam/tracking/trajectory.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Ids that no piece of map has yet, nor any after them.
struct NextIds {
  uint32_t keyframe = 0, landmark = 0, object = 0;
};

// Follows the camera from frame to frame on snapshots of the map, and tells the mapper what to add.
class Tracker {
 public:
  struct Outcome {
    TrackingState state = TrackingState::kLost;
    std::optional<Rigid3> cam_from_world;
    int matched = 0, inliers = 0;
    int objects = 0;        // mapped objects seen
    double confidence = 0;  // [0, 1], of the pose
    double depth = 0;       // median, of the landmarks that stand for it
    double ms_objects = 0;
    std::optional<PoseAnchor> anchor;  // of a lost camera, or one that has just come back
    std::optional<MapCommand> command;
    bool map_required = false;  // AdoptInitialMap must follow, with the map that holds the command
    bool is_urgent = false;     // the next frame needs the map that holds the command
    bool is_keyframe = false;
    bool gives_up = false;  // lost, in a map too small to look for the camera there: a tracker of
                            // another one goes on

    static Outcome Tracked(TrackingState state, const Rigid3& cam_from_world, int matched,
                           int inliers);
  };

  // `map_is_loaded`: it begins lost in a map that is there already.
  Tracker(const SlamConfig& config, const NextIds& ids, bool map_is_loaded);

  void SetRelocalizationMode(RelocalizationMode mode) { relocalization_mode_ = mode; }
  // Without mapping the map is only read: no keyframes, no objects, no new map.
  void SetMapping(bool enabled) { mapping_ = enabled; }

  Outcome Track(const Frame& frame, const Map& map);
  // A frame in which a lost camera is not looked for.
  Outcome PassOver(const Frame& frame);
  // Takes over a map that Track asked for; back to initialising where the mapper refused it.
  Outcome AdoptInitialMap(const Frame& frame, const Map& map);

  // Detections of a frame that was tracked while they were still to come: they count at the pose it
  // has by now. Of a frame in which the camera was lost, and still is, they are searched for its
  // pose, and tracking goes on from there. Frames ascend; nothing where the frame is too old.
  std::optional<Outcome> AddDetections(int frame_index, std::vector<ObjectDetection> detections,
                                       const Map& map);

  // Goes on as another tracker, whose map was joined with this one's, `scale` times as large as it
  // was; the poses of its frames join this trajectory.
  void GoOnAs(Tracker other, double scale);
  // Frames of a piece that was joined with the map: those that have no pose by points here take
  // theirs.
  void Adopt(const std::vector<FramePose>& poses, double scale) { trajectory_.Adopt(poses, scale); }
  // All but that of landmarks, which the mapper counts.
  NextIds next_ids() const { return {next_keyframe_, 0, object_tracks_.next_object}; }
  void SkipIds(const NextIds& ids);

  // To look back, once a video is over: takes up a frame that has a pose by points, and goes on
  // from there in either direction of time. Keyframes are made as ever; objects are not observed.
  // On thin evidence: few landmarks, close together, are enough.
  bool TakeUp(const Frame& frame, const Map& map, bool on_thin_evidence);
  // Nothing where the frame cannot be followed.
  std::optional<Outcome> Extend(const Frame& frame, const Map& map);
  // Whether a frame has a pose by points.
  bool HasTracked(int frame_index) const;
  // Of a frame that has a pose.
  std::optional<Rigid3> PoseOf(int frame_index, const Map& map) const;
  // What another tracker found that was copied from this one to look back.
  void Learn(Tracker other);

  // Of the newest frame, all but the map.
  FrameView View() const;
  // Gives up the pose it follows, if it follows one.
  void ForceRelocalization();

  // The newest frame, as tracked.
  Outcome Present(const Map& map) const;

  bool IsInitializing() const { return phase_ == Phase::kInitializing; }
  // While it is initialising: why there is no map yet.
  const std::string& why_no_map() const { return initializer_.why_not(); }
  bool IsMapping() const { return mapping_; }
  // What was seen since the last command, for the mapper.
  MapCommand TakeRest();
  // Poses of all frames so far, relative to keyframes of the map or retired from it.
  const std::vector<FramePose>& trajectory() const { return trajectory_.poses(); }
  // Refines what is left to refine of the trajectory on the finished map.
  void SettleTrajectory(const Map& map);

 private:
  void Take(const Frame& frame);
  enum class Phase { kInitializing, kTracking, kLost };

  // Of a pose, relative to a keyframe of the map.
  static Rigid3 RelativeTo(const Map& map, KeyframeId reference, const Rigid3& cam_from_world) {
    return cam_from_world * map.keyframes.At(reference).cam_from_world.Inverse();
  }
  Outcome Initialize(const Frame& frame, const Map& map);
  Outcome Relocalize(const Frame& frame, const Map& map);
  TrackReport TrackFound(const Frame& frame, const Map& map, const Relocalization& found) const;
  // Whether a camera that was where it was seen last can be there by now (IsContinuous).
  bool CouldHaveGone(const Frame& frame, const Map& map, const TrackReport& tracked) const;
  Outcome FindLate(const Frame& frame, const Map& map);
  Outcome Continue(const Frame& frame, const Map& map, const TrackReport& tracked,
                   TrackingState state);
  Outcome ShowObjectPose(const Frame& frame, const Map& map, const Relocalization& found);
  bool IsOnProbation(const Frame& frame) const;  // found by points a moment ago
  TrackDemands Demands(const Frame& frame) const;
  double LeastSpread() const;
  // From the last frame to this one, by the surest way that works.
  TrackReport Follow(const Frame& frame, const Map& map);
  const Keyframe* LastAsKeyframe(const Map& map) const;
  Rigid3 Predict(const Rigid3& last_pose, double timestamp) const;
  void FillInBeforeMap(const Map& map);
  Outcome Lose(const Frame& frame);
  Outcome GiveUp();
  void Miss(const Frame& frame, bool has_pose);
  void FillInMissed(const Map& map, int count);
  void EndBackfill();
  void Remember(const Frame& frame, const Map& map, const TrackReport& tracked,
                TrackingState state);
  void MakeKeyframe(const Frame& frame, const Map& map, const TrackReport& tracked,
                    Outcome& outcome);
  std::vector<LandmarkUse> TakeUses();
  void ObserveObjects(const Frame& frame, const Map& map, const TrackReport& tracked,
                      Outcome& outcome);
  int Associate(const TrackedFrame& seen, const Map& map);

  struct Last {
    Frame frame;
    std::vector<LandmarkId> landmarks;
    KeyframeId reference;
    Rigid3 cam_from_reference;
  };

  // Of the camera between the last two frames.
  struct Motion {
    Rigid3 cam_from_before;
    double seconds = 0;
    double error =
        0;  // how far from where it led to landmarks were found, median; pixels of the lowest level
  };

  struct Missed {
    Frame frame;
    bool has_pose = false;  // by objects
  };
  // A frame whose detections are still to come.
  struct Undetected {
    TrackedFrame tracked;
    bool has_pose = false;  // by points
  };
  // Where the way back in time has come to.
  struct Backfill {
    std::shared_ptr<const Features> features;
    TrackReport after;
    int index = 0;
    bool proven = false;  // the camera's return has proved itself
  };

  SlamConfig config_;
  Initializer initializer_;
  Relocalizer relocalizer_;
  RelocalizationMode relocalization_mode_ = RelocalizationMode::kPointsAndObjects;
  Rng rng_;
  Phase phase_ = Phase::kInitializing;
  bool map_is_loaded_;
  bool mapping_ = true;
  uint32_t next_keyframe_;
  Frame newest_;                                      // also without a pose
  std::optional<RelocalizationNote> relocalization_;  // of the newest frame
  std::optional<Last> last_;
  std::vector<Frame> before_map_;     // frames that came before there was one, in order
  std::deque<Missed> missed_;         // the newest frames without points to track
  std::optional<Backfill> backfill_;  // since the camera was found
  std::optional<Motion> motion_;
  KeyframeId newest_keyframe_;
  int newest_keyframe_frame_ = 0;
  double newest_keyframe_time_ = 0;
  int newest_keyframe_inliers_ = 0;
  int newest_frame_ = 0;
  std::optional<int> relocalized_frame_;  // the newest when the camera was last found
  double relocalized_time_ = 0;
  bool takes_thin_evidence_ = false;
  bool is_pose_doubted_ = false;  // by the user: the last pose tells nothing of the next
  double usual_spread_ = 0;        // of the landmarks in the image, over the last seconds
  std::vector<LandmarkUse> uses_;  // since the newest keyframe
  ObjectTracks object_tracks_;
  std::vector<ObjectSighting> sightings_;  // since the newest keyframe
  std::deque<Undetected> undetected_;      // ascending by frame
  Trajectory trajectory_;
};

}  // namespace oaslam
