#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/camera.h"
#include "oaslam/class_relations.h"
#include "oaslam/config.h"
#include "oaslam/error.h"
#include "oaslam/export.h"
#include "oaslam/fork.h"
#include "oaslam/ids.h"
#include "oaslam/image_input.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/object_edit.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/rigid3.h"
#include "oaslam/slam_state.h"
#include "oaslam/tracking_result.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/types.h"

namespace oaslam {

// How often the images showed a mapped object in its place.
struct ObjectPresence {
  ObjectId id;
  int category_id = 0;
  int expected = 0,
      seen = 0;  // numbers of images that should have shown it in its place, and that did
  // Whether it was moved or taken away: it was missed more often than its detection rate explains.
  bool is_missing = false;
};

// A world that had the same frame as the present one, and a unit that was `scale` times as long as
// that of the present one.
struct FormerWorld {
  WorldId world;
  double scale = 1;
};

// A key point of an image, and the landmark that it was matched with.
struct TrackedPoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // in the image as it was given
  double sigma_px = 1;                              // standard deviation of that place
  std::optional<LandmarkId> landmark;               // in the map
  // Position of that landmark, world.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// Mapping has stopped, because memory ran out or an invariant of the map was violated; what() says
// which. The map is as it was before the failed step, and can be saved:
//
//   try {
//     slam.Process(input);
//   } catch (const MappingError&) {
//     slam.Save("until_here.map");
//   }
class OASLAM_API MappingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Monocular SLAM with points and objects. Only one thread at a time may use it; other threads read
// States(). Take SlamConfig::Live() for a camera, SlamConfig::Offline() for recordings. A
// moved-from Slam may only be destroyed or assigned to:
//
//   Slam slam(SlamConfig::Live(), LoadCamera("camera.yaml"));
//   while (const auto image = source->Next()) {
//     const TrackingResult result = slam.Process({image->image, image->timestamp});
//     if (const auto world_from_cam = result.PoseIn(result.world)) Draw(*world_from_cam);
//   }
//   slam.Save("room.map");
//
// Waiting. In live mode, Process, AddDetections, the functions that only read, and those that find
// a single image do not wait for mapping unless their comment says so. Save and the functions that
// change or replace the map (anchors, EditObject, SetMetresPerUnit, SetMapping, SetClassRelations,
// ForceRelocalization, Load, Reset, the destructor) wait until the queued keyframes, at most eight,
// are in the map.
//
// Errors. A configuration, image, detection or map file that cannot be used throws InputError and
// changes nothing. Once mapping has failed, Process and the functions that change the map throw
// MappingError at every call. Finish throws it only where no call has thrown it before, so that a
// program which has reported the failure can still finish. All other functions keep working, and
// Load and Reset recover. In a forked child every function of a Slam of the parent throws
// ForkError. Exceptions reach the caller of a function only, never a thread of the library.
//
// What Reset, Load and SetMapping change and keep, in whatever order they are called:
//
// |                             | Reset          | Load                 | SetMapping    |
// |-----------------------------|----------------|----------------------|---------------|
// | map, anchors, trajectory    | emptied        | those of the file    | kept          |
// | frame numbers, time stamps  | begin anew     | begin anew           | go on         |
// | the camera                  | begins a map   | is lost, until found | is tracked on |
// | class names and relations   | kept           | those of the file    | kept          |
// | NameRecording, SetMask      | kept           | kept                 | kept          |
// | SetMapping                  | kept           | kept                 | set           |
// | SetRelocalizationMode       | kept           | kept                 | kept          |
// | States() handed out before  | go on          | go on                | go on         |
class OASLAM_API Slam {
 public:
  // Begins without a map. Throws InputError for settings out of their bounds, and for a camera that
  // CheckCalibration refuses.
  Slam(const SlamConfig& config, const Camera& camera);
  // Ends the mapping thread once its queue is done.
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  // Tracks one image and extends the map. Time stamps must ascend: an image that is not newer than
  // the last throws InputError. How long it waits for mapping depends on the mode. Sequential:
  // until this image is mapped. Lockstep: until the image `runner.lag` before this one is mapped.
  // Live: only where tracking depends on it, which is for the initial map, for a keyframe made
  // because few landmarks are left in view, when a submap is begun, joined or left, and while
  // eight keyframes are queued. An image in which a lost camera is looked for takes some ten times
  // as long as a tracked one.
  TrackingResult Process(const ImageInput& input);

  // Adds detections of an image that was processed with `detections_follow`; `frame` is its
  // TrackingResult::frame. They are used with the pose of that image. Frames must ascend; a frame
  // that is skipped counts as one without detections. Returns the number of mapped objects seen, or
  // nothing where the image is too old (4 s at 30 Hz) or had no pose. If the camera is lost and
  // these detections find it, tracking continues from there.
  std::optional<int> AddDetections(int frame, const std::vector<Detection>& detections);

  // Finds one image in the map, independent of all others; the map is not changed, and tracking
  // goes on where it was. Without an image it is looked for by its boxes alone. The time stamp is
  // used with `options.follow` only; ForceRelocalization drops the evidence of the images followed
  // so far. A map that does not change is read faster, and by many threads at once, by a
  // MapLocalizer.
  RelocalizationResult Relocalize(const ImageInput& input, const RelocalizeOptions& options = {});

  // Which evidence Process uses to find the camera again after tracking was lost.
  void SetRelocalizationMode(RelocalizationMode mode);

  // Switches mapping on or off. Without mapping, Process tracks the camera in a map from Load
  // (before or after this call), and neither Process nor Finish changes the map. On by default.
  void SetMapping(bool enabled);

  // Names of the detector's categories, saved with the map; by default those of COCO. Load replaces
  // them by those of the file.
  void SetClassNames(std::map<int, std::string> names);

  // Sets the name of the recording whose images Process gets, and where these images are. Both are
  // saved with the map, so that it can tell its recordings apart after images of another recording
  // have extended it.
  void NameRecording(const std::string& name, const std::string& images);

  // Parts of the images that move with the camera, such as a bonnet or a robot's chassis: nothing
  // there is used. `mask` is 8-bit grey, of the camera's size; 0 hides. An empty mask, the default,
  // makes Process find such parts itself: a connected part that stays still in the image for
  // seconds while the rest moves; a warning says where. A mask without a 0 hides nothing and
  // switches this search off. Throws InputError for a mask of another size or type, or one that
  // hides all.
  void SetMask(const cv::Mat& mask);

  // Sets which classes can move, and which are parts of others; saved with the map. Objects of
  // classes that move are neither mapped nor tracked: they are removed from the map, and key points
  // in their boxes are not used (where detections come with the image). Load replaces the relations
  // by those of the file.
  void SetClassRelations(const ClassRelations& relations);

  // How often each of the map's objects was seen while the map was not changed (without mapping, or
  // by Relocalize), in the order of ids.
  std::vector<ObjectPresence> Presence() const;

  // Gives up the present pose: the next image is relocalized. `near`: the camera's supposed pose,
  // world_from_cam. Each image is looked for there first until one is found.
  void ForceRelocalization(const std::optional<Rigid3>& near = std::nullopt);

  // Scales the map to metres: a present unit is so many metres long. All results from then on are
  // in metres, in a new world, and tracking continues. Other submaps become metric when they
  // are joined with this one. This submap stays the main one from then on, however small it is, as
  // a loaded one does. Waits until everything seen is in the map. Throws InputError for a number
  // that is not finite and above 0, and while there is no map.
  void SetMetresPerUnit(double metres);
  // Scales the map to metres by the usual sizes of its objects (MapSnapshot::EstimateScale of
  // Snapshot or WholeMap). The map keeps the standard deviation of its unit. Throws InputError also
  // where the estimate has failed or rests on no object.
  void SetMetresPerUnit(const ScaleEstimate& estimate);

  // The worlds that became the present one (Snapshot().world()) by a change of the unit alone: by
  // SetMetresPerUnit, or by a sensor that told the length of a metre.
  std::vector<FormerWorld> FormerWorlds() const;

  // What the ray of a pixel of the newest image meets (MapSnapshot::Cast); nothing where that image
  // has no pose. Throws InputError for a pixel that is not in the image.
  std::vector<RayHit> Cast(const Eigen::Vector2d& pixel) const;

  // The anchors of virtual content, which are saved with the map. A submap with anchors stays the
  // main one: while the camera is lost in it, no other submap gives a pose. Anchors move with the
  // map in bundle adjustment and loop closing, and with the object on which they stand.
  std::vector<AnchorPose> Anchors() const;
  // The edits of anchors wait until all queued keyframes are in the map, since an earlier snapshot
  // may have another scale. In live mode at most eight keyframes are queued.
  [[nodiscard]] AnchorReport PlaceAnchor(const AnchorRequest& request);
  // Refused where there is no anchor of this name, and where a value of the edit is not valid.
  [[nodiscard]] AnchorReport EditAnchor(const std::string& name, const AnchorEdit& edit);
  // Refused where there is no anchor of this name.
  [[nodiscard]] AnchorReport RemoveAnchor(const std::string& name);

  // Renames an object, merges it with another one that is the same thing, or removes it. Waits for
  // the queued keyframes, as PlaceAnchor does. Throws InputError as EditObject of map_editing.h
  // does.
  void EditObject(ObjectId object, const ObjectEdit& edit);

  // The map that the last call worked with, without other submaps and without trajectory.
  // Does not wait for mapping.
  MapSnapshot Snapshot() const;
  // The map as Save writes it: all submaps, and the trajectory so far. Waits as Save does.
  MapSnapshot WholeMap() const;

  // The key points of the newest image, each with its landmark if that agrees with the pose. Where
  // dead reckoning needed no key points, the landmarks of the last image that had some, at the
  // pixels where they project. Without a pose by points no point has a landmark; without an image
  // the result is empty.
  std::vector<TrackedPoint> TrackedPoints() const;

  // What a viewer shows of an image; known to the library alone.
  struct View;
  // Returns the view of the newest image, for MapViewer.
  std::shared_ptr<const View> NewestView() const;

  // The newest result and map, for other threads; both are replaced after each image and after each
  // call that changes the map.
  SlamStates States() const;

  // The present poses of the frames given to Process, by time stamp: they move as the map is
  // corrected. Frames in other submaps than the main one are missing until the submaps are joined.
  // Of the frames given while mapping was off (SetMapping), about the newest 100 000 poses are
  // kept.
  std::vector<StampedPose> Trajectory() const;

  // Sets the pose of the IMU relative to the camera: Kalibr's T_cam_imu, translation in metres.
  // Without it, the axes of the IMU are those of the camera, and its place is the camera's. What
  // was learned of an IMU is forgotten, and the odometry begins anew. Throws InputError for a
  // motion that is not valid or longer than 10 m.
  void SetImu(const Rigid3& cam_from_imu);
  // What is known of the gyroscope whose samples came with the images.
  GyroscopeCalibration Gyroscope() const;
  // What is known of the IMU whose samples came with the images.
  ImuCalibration Imu() const;

  // Waits until everything seen is in the map, and optimises it a last time on the caller's thread,
  // which takes seconds for a room and minutes for a building. Process may be called again
  // afterwards. Where a lost camera began several submaps, the largest one is the map from now on;
  // Snapshot().world() is its world, in which Trajectory is, too.
  void Finish();
  // Writes all submaps, and the trajectory so far; calling Finish before makes the map
  // better. Waits until the keyframes made so far are in the map. The file is replaced as a whole,
  // or not at all. Throws InputError where it cannot be written.
  void Save(const std::string& path) const;
  // Replaces the map by that of a file; the next image is relocalized in it and may have any time
  // stamp. The file's camera may differ from this one. `submap` selects one of several submaps (0:
  // the main one when it was saved; then the others, largest first); the rest are joined with it
  // once images link them. The settings stay (SetMapping, SetRelocalizationMode). If it throws,
  // nothing has changed.
  void Load(const std::string& path, int submap = 0);
  // Replaces the map by one that is in memory. Slam and the snapshot share it until Slam changes
  // it, and also share the place index of a MapLocalizer's map.
  void Load(const MapSnapshot& map);

  // Forgets the map and all images: the next image begins a new map and may have any time stamp.
  // The settings (SetMapping, SetRelocalizationMode), class names and relations stay.
  void Reset();

 private:
  class Impl;
  ProcessBound<Impl> impl_;
};

}  // namespace oaslam
