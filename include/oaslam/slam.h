#pragma once

#include <Eigen/Core>
#include <cstdint>
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
#include "oaslam/image_input.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/rigid3.h"
#include "oaslam/slam_state.h"
#include "oaslam/tracking_result.h"
#include "oaslam/trajectory_file.h"
#include "oaslam/types.h"

namespace oaslam {

// Whether the images show a mapped object in its place.
struct ObjectPresence {
  uint32_t id = 0;
  int category_id = 0;
  int expected = 0,
      seen = 0;  // number of images that should have shown it in its place, and that did
  // It was moved or taken away: its detection rate does not explain how often it was not seen.
  bool is_missing = false;
};

// A key point of an image, and the landmark that it was matched with.
struct TrackedPoint {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // in the image as it was given
  double sigma_px = 1;                              // standard deviation of that place
  std::optional<uint32_t> landmark;                 // its id in the map
  // Where that is, world.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

// Mapping has ended, because memory ran out or an invariant of the map was violated: what() says
// why. The map is as it was before that, and can be saved.
class OASLAM_API MappingError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Monocular SLAM with points and objects. One that was moved from may only be destroyed or
// assigned. To be used by one thread at a time; States() is for the others. Mapping runs on a
// thread of its own, in the way that runner.mode names; in sequential mode Process maps, too.
//
// Waiting. In live mode Process, AddDetections, the functions that only read, and those that find
// an image by itself do not wait for mapping, but where a comment says so. The functions that
// change the map or begin with another (anchors, SetMetresPerUnit, SetMapping, SetClassRelations,
// ForceRelocalization, Load, Reset, Shutdown, the destructor) and Save wait until the keyframes
// that are queued are in the map, of which there are at most eight.
//
// Errors. InputError, and nothing has changed, for a configuration, image, detection or map file
// that cannot be used. If mapping fails, Process and the functions that change the map throw
// MappingError from then on, Finish only if no other call has; all others still work, and Load and
// Reset begin anew. No exception leaves a thread.
//
// What Reset, Load and SetMapping leave as it was, in whatever order they are called:
//
// |                             | Reset          | Load                 | SetMapping    |
// |-----------------------------|----------------|----------------------|---------------|
// | map, anchors, trajectory    | emptied        | those of the file    | kept          |
// | frame numbers, time stamps  | begin anew     | begin anew           | go on         |
// | the camera                  | begins a map   | is lost, until found | is tracked on |
// | class names and relations   | kept           | those of the file    | kept          |
// | SetMapping                  | kept           | kept                 | set           |
// | SetRelocalizationMode       | kept           | kept                 | kept          |
// | Shutdown                    | kept           | kept                 | kept          |
// | States() handed out before  | go on          | go on                | go on         |
class OASLAM_API Slam {
 public:
  // Begins without a map. Throws InputError for settings out of their bounds, and for a camera that
  // CheckCalibration refuses.
  Slam(const SlamConfig& config, const Camera& camera);
  // Ends as Shutdown does.
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  // Tracks one image and extends the map. Time stamps must ascend: an image that is not newer than
  // the last throws InputError. Waits for mapping: sequential, until the image is mapped; lockstep,
  // until the images up to `runner.lag` before this one are; live, only where tracking cannot go on
  // without: for an initial map, for a keyframe made because few landmarks are left in view, when a
  // piece of map is begun, joined or left, and while eight keyframes are queued.
  TrackingResult Process(const ImageInput& input);

  // Adds detections of an image that was processed with `detections_follow`; `frame` is its
  // TrackingResult::frame. They are used at the pose that the image had. Images must ascend; images
  // that are skipped count as having none. Returns the number of mapped objects seen, or nothing
  // where the image is too old (4 s at 30 Hz) or had no pose. A lost camera that is found in that
  // image is tracked on from there.
  std::optional<int> AddDetections(int frame, const std::vector<Detection>& detections);

  // Finds one image in the map, independent of all others; the map is not changed. `prior`: where
  // the camera is thought to be, world_from_cam; the image's points are looked for there first, and
  // it is never trusted. By objects alone it is not used.
  RelocalizationResult Relocalize(const ImageInput& input, RelocalizationMode mode,
                                  const std::optional<Rigid3>& prior = std::nullopt);
  // The same for an image whose camera is unknown: as if a camera of the map had taken it, or with
  // a focal length estimated from its points. Of this Slam's camera only the image size is used.
  RelocalizationResult RelocalizeWithUnknownCamera(const ImageInput& input,
                                                   RelocalizationMode mode);
  // The same by detections only.
  RelocalizationResult RelocalizeByObjects(
      const std::vector<Detection>& detections,
      const std::optional<Eigen::Vector3d>& gravity_in_cam = std::nullopt);
  // The same by the detections of successive images: what those of the last second told counts,
  // too. Time stamps (seconds) must ascend from call to call of this function. ForceRelocalization
  // forgets the images.
  RelocalizationResult FollowByObjects(
      double timestamp, const std::vector<Detection>& detections,
      const std::optional<Eigen::Vector3d>& gravity_in_cam = std::nullopt);

  // Which evidence Process uses to find the camera again after tracking was lost.
  void SetRelocalizationMode(RelocalizationMode mode);

  // Switches mapping on or off. Without mapping, Process tracks the camera in a map from Load
  // (before or after this call), and neither Process nor Finish changes the map. On by default.
  void SetMapping(bool enabled);

  // Names of the detector's categories, saved with the map; by default those of COCO. Load replaces
  // them by those of the file.
  void SetClassNames(std::map<int, std::string> names);

  // Which classes move, and which are parts of others; saved with the map. Objects of classes that
  // move are neither mapped nor tracked: they are removed from the map, and key points in their
  // boxes are not used (where detections come with the image). Load replaces the relations by those
  // of the file.
  void SetClassRelations(const ClassRelations& relations);

  // What was seen of the map's objects while the map was only read (without mapping, or by
  // Relocalize), in the order of ids.
  std::vector<ObjectPresence> Presence() const;

  // Gives up the present pose: the next image is relocalized. `near`: where the camera is thought
  // to be, world_from_cam. It is looked for there first, in each image until it is found.
  void ForceRelocalization(const std::optional<Rigid3>& near = std::nullopt);

  // Makes the metre the unit of the map: a present unit has so many metres. Everything that is
  // asked for from then on is in metres, and the camera is tracked on; what other pieces of map
  // hold becomes metric when they are joined with this one. From then on this piece stays the main
  // one, as if it were loaded, also where it is small. Waits until everything seen is in the map.
  // Throws InputError for a number that is not finite and above 0, and while there is no map.
  void SetMetresPerUnit(double metres);

  // Virtual content in the map, saved with it. It moves as the map moves: with bundle adjustment,
  // with loops, and with the object it stands on.
  std::vector<AnchorPose> Anchors() const;
  // An edit waits until everything seen is in the map, since a snapshot from before may have
  // another scale. In live mode these are at most eight keyframes.
  AnchorReport PlaceAnchor(const AnchorRequest& request);
  // Returns why the anchor cannot be changed, or an empty text.
  std::string EditAnchor(const std::string& name, const AnchorEdit& edit);
  // Returns false where there is no such anchor.
  bool RemoveAnchor(const std::string& name);

  // The map that the last call worked with; it does not wait for mapping.
  MapSnapshot Snapshot() const;

  // The key points of the newest image, with the landmarks that agree with its pose. Without a pose
  // by points no point has a landmark; without an image it is empty.
  std::vector<TrackedPoint> TrackedPoints() const;

  // The newest results and maps, for other threads: after each image, and after each call that
  // changes the map.
  SlamStates States() const;

  // The poses of the frames given to Process, by time stamp, as of now: they move with the map.
  // They are those in the main piece of map: frames in other pieces are missing until the pieces
  // are joined.
  std::vector<StampedPose> Trajectory() const;

  // Waits until everything seen is in the map, and optimises it a last time, on the caller's
  // thread: seconds for a room, minutes for a building. Process may be called again afterwards.
  void Finish();
  // The number (TrackingResult::piece) of the map: after Finish it may differ from
  // that of the last image.
  int MainPiece() const;
  // Writes the map, all its pieces, and the trajectory so far; Finish before it makes the map
  // better. Waits until the keyframes made so far are in the map. The file is replaced as a whole.
  // Throws InputError where it cannot be written.
  void Save(const std::string& path) const;
  // Replaces the map by that of a file; the next image is relocalized in it and may have any time
  // stamp. The file's camera may differ from this one. `piece`: selects the piece of a map with
  // several (0: the one that was the main one; the others by size, the largest first); the others
  // are joined with it once images link them. The settings stay (SetMapping,
  // SetRelocalizationMode). If it throws, nothing has changed.
  void Load(const std::string& path, int piece = 0);

  // Forgets the map and all images: the next image begins a new map and may have any time stamp.
  // The settings (SetMapping, SetRelocalizationMode), class names and relations stay.
  void Reset();
  // Ends the mapping thread without losing queued work; later calls map on the caller's thread.
  // Idempotent. Also done by the destructor.
  void Shutdown();

 private:
  friend class SlamAccess;  // for the programs in this repository
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace oaslam
