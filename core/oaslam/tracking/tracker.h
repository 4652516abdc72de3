#pragma once

#include <algorithm>
#include <climits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/frame_view.h"
#include "oaslam/mapping/map_command.h"
#include "oaslam/tracking/image_pose.h"
#include "oaslam/tracking/initializer.h"
#include "oaslam/tracking/keyframe_decision.h"
#include "oaslam/tracking/keyframe_units.h"
#include "oaslam/tracking/lost_camera.h"
#include "oaslam/tracking/object_watch.h"
#include "oaslam/tracking/odometry_link.h"
#include "oaslam/tracking/tracking_context.h"
#include "oaslam/tracking/trajectory.h"

namespace oaslam {

// There is no map yet.
struct Initializing {
  Initializer initializer;
  // The keyframes of an initial map that the mapper was told to make; invalid where it was not.
  KeyframeId first{}, second{};
};

// The camera's pose in the map is known.
struct Following {
  TrackedFrame last;  // the newest image with a pose and features
  // The highest confidence of a pose that the map gave since the camera was last lost.
  double best_confidence = 0;
};

// The camera is looked for in the map.
struct Lost {
  // Set by Tracker::ForceRelocalization: a supposed pose, world_from_cam, around which landmarks
  // are searched first; and whether the camera may have jumped, so that a new pose need not lie
  // near the last one.
  std::optional<Rigid3> prior{};
  bool is_pose_doubted = false;
};

// The camera was lost in a map that is too small to find it again.
struct GivenUp {};

struct TrackingStep {
  ImagePose pose;
  std::optional<MapCommand> command{};   // for the mapper
  std::optional<KeyframeId> keyframe{};  // that the image becomes
  // The pose, where it is evidence for the transformation between another submap and this one
  // (SubmapLink): by objects alone, or by the map while another submap grows.
  std::optional<Relocalization> located{};
  double ms_objects = 0;
};

// Follows the camera from image to image on snapshots of the map, and tells the mapper what to add.
// A tracker is in one of four phases; all its other parts outlive a phase.
class Tracker {
 public:
  // `map_is_loaded`: the tracker begins as lost in a map that exists already, and makes no other.
  Tracker(const SlamConfig& config, bool map_is_loaded);

  // Uses an index of the map that was made elsewhere, to find a lost camera.
  void Use(std::shared_ptr<const LandmarkIndex> index) { search_.Use(std::move(index)); }

  // As Atlas::NeedsFeatures.
  bool NeedsFeatures(double timestamp, const FrameMotion* motion, MapUse use) const;
  TrackingStep Track(const Frame& frame, const Map& map, const TrackingContext& context);
  // Records an image without trying to relocalize the lost camera in it.
  TrackingStep PassOver(const Frame& frame, const Map& map, const TrackingContext& context);
  // Whether the image that was tracked last asks for an initial map. Then the caller hands the
  // command to the mapper, and calls Begin with the map that results.
  bool AwaitsMap() const;
  // Begins to follow the camera in the initial map, or goes on without one where the mapper has
  // refused it.
  TrackingStep Begin(const Frame& frame, const Map& map);

  // Detections of an image that was given without them (Frame::detections_follow). If it has a
  // pose, they are associated with objects at its present pose. If the camera was lost in it and
  // still is, they relocalize the image, and tracking continues from there. Images ascend. Returns
  // nothing where the image is too old.
  std::optional<TrackingStep> AddDetections(int frame_index,
                                            std::vector<ObjectDetection> detections, const Map& map,
                                            const TrackingContext& context);

  // Continues with the state of another tracker, whose map was joined with this one's and scaled by
  // `scale`; the poses of its images are added to this trajectory.
  void GoOnAs(Tracker other, double scale);
  // Takes over the poses of a submap that was joined with the map and scaled by `scale`, for images
  // that have no pose by points here.
  void Adopt(const std::vector<FramePose>& poses, double scale) {
    trajectory_.Adopt(poses, scale);
    if (!poses.empty()) last_mapped_ = std::max(last_mapped_, poses.back().frame_index);
    units_.BeginAnew();
    certainty_ = {};
  }
  // Makes the tracker lose its pose, if it has one: the next image is relocalized. `near`: supposed
  // pose, world_from_cam, around which landmarks are searched first until the camera is found.
  void ForceRelocalization(const std::optional<Rigid3>& near);
  // Continues in the same map after all of its lengths were multiplied by `factor`.
  void Scale(double factor);

  // The pose of the newest image, computed again with `map`; lost where the camera is not followed.
  ImagePose Present(const Map& map);

  bool IsInitializing() const { return std::holds_alternative<Initializing>(phase_); }
  bool HasGivenUp() const { return std::holds_alternative<GivenUp>(phase_); }
  // While it is initializing: why there is no map yet.
  std::string why_no_map() const;
  // Whether an image has a pose by points.
  bool HasTracked(int frame_index) const;
  // cam_from_world of an image, or nothing where it has no pose.
  std::optional<Rigid3> PoseOf(int frame_index, const Map& map) const;
  // The length of the odometry's unit in the map; nothing as long as it is not known for the run of
  // this image.
  std::optional<double> MotionUnit(const Frame& frame) const;
  // The length of the map's unit in metres, as an IMU or a depth camera tells it; nothing as long
  // as none does.
  std::optional<MeasuredMetre> metre() const { return link_.metre(); }
  int newest_frame() const { return newest_.frame.index; }
  // Time stamp of the newest image whose pose the map gave; minus infinity where there is none.
  double seen_at() const { return link_.seen_at(); }
  // What a viewer shows of the newest image; the caller adds the map.
  FrameView View() const;
  // Removes and returns the observations of landmarks and objects since the last command.
  MapCommand TakeRest();
  // Poses of all images so far, relative to keyframes of the map or retired ones.
  const std::vector<FramePose>& trajectory() const { return trajectory_.poses(); }
  // Refines the poses of images that are not refined yet against the finished map.
  void RefineTrajectory(const Map& map) {
    FollowLoops(map);
    trajectory_.RefinePosesBefore(map, INT_MAX);
  }

 private:
  // cam_from_reference of a pose.
  static Rigid3 RelativeTo(const Map& map, KeyframeId reference, const Rigid3& cam_from_world);
  static TrackedFrame Placed(const Frame& frame, const Map& map, const TrackReport& tracked);
  void Take(const Frame& frame);
  void FollowLoops(const Map& map);
  void BoundTrajectory(const TrackingContext& context);
  // Process an image in one of the phases.
  TrackingStep Initialize(const Frame& frame, const TrackingContext& context);
  TrackingStep Follow(const Frame& frame, const Map& map, const TrackingContext& context);
  TrackingStep Search(const Frame& frame, const Map& map, const TrackingContext& context);

  // For an image with a pose in the map, or by dead reckoning.
  TrackingStep Continue(const Frame& frame, const Map& map, const TrackReport& tracked,
                        TrackingState state, const TrackingContext& context);
  std::optional<TrackingStep> Correct(const Frame& frame, const Map& map,
                                      const TrackingContext& context);
  TrackingStep Carry(const Frame& frame, const Map& map, const OdometryPrediction& predicted,
                     const TrackingContext& context);
  Following& Remember(const TrackedFrame& seen, const TrackReport& tracked, TrackingState state,
                      const Map& map);
  void ObserveObjects(const TrackedFrame& seen, const Map& map, const TrackingContext& context,
                      TrackingStep& step);
  void MakeKeyframe(const TrackedFrame& seen, const Map& map, const TrackReport& tracked,
                    const TrackingContext& context, TrackingStep& step);
  void InsertKeyframe(const TrackedFrame& seen, const Map& map, const TrackReport& tracked,
                      const TrackingContext& context, TrackingStep& step);
  void PlaceLostImages(const TrackedFrame& found, const Map& map);
  TrackDemands Demands() const;

  // For an image in which the camera is lost, or was.
  Relocalization Find(const Frame& frame, const Map& map, const TrackingContext& context,
                      const std::optional<Rigid3>& prior);
  TrackingStep PlaceFound(const Frame& frame, const Map& map, const Relocalization& found,
                          const TrackingContext& context);
  std::optional<TrackingStep> LookAgain(const Frame& frame, const Map& map,
                                        const TrackingContext& context);
  TrackReport Confirm(const Frame& frame, const Map& map, const Relocalization& found,
                      bool is_pose_doubted) const;
  TrackingStep PlaceByObjects(const Frame& frame, const Map& map, const Relocalization& found,
                              const TrackingContext& context);
  ImagePose PlaceByRegistration(const Frame& frame, const Map& map, const TrackingContext& context);
  ImagePose Record(const Frame& frame, const Map& map, const ImagePose& pose);
  TrackingStep Miss(const Frame& frame, const Map& map, const TrackingContext& context);

  SlamConfig config_;
  bool map_is_loaded_;
  std::variant<Initializing, Following, Lost, GivenUp> phase_;
  OdometryLink link_;
  LostCamera search_;
  ObjectWatch objects_;
  KeyframeDecision keyframes_;
  PoseCertainty certainty_;
  FrameView newest_;               // without map, pose and objects
  double usual_spread_ = 0;        // TrackReport::spread, averaged over the last seconds
  std::vector<LandmarkUse> uses_;  // since the newest keyframe
  Trajectory trajectory_;
  int last_mapped_ = -1;        // newest frame with which the map was extended
  bool has_forgotten_ = false;  // some poses of the trajectory were dropped
  KeyframeUnits units_;         // of the lengths in this tracker
};

}  // namespace oaslam
