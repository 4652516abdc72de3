#pragma once

#include <map>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/camera.h"
#include "oaslam/class_relations.h"
#include "oaslam/config.h"
#include "oaslam/error.h"
#include "oaslam/export.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

struct ImageInput {
  cv::Mat image;         // 8-bit, one channel or BGR, of the camera's size
  double timestamp = 0;  // seconds, ascending
  // From an object detector, in pixels of this image; may be empty. Class, score and box are used;
  // an ellipse is not.
  std::vector<Detection> detections;
  // The detections will be given later, by AddDetections.
  bool detections_follow = false;
  // Gravity in the camera's frame (OpenCV axes) where a sensor measures it, of any length. For an
  // accelerometer give the measured length: it shows how much the hand shook. Where keyframes have
  // gravity, the map's vertical is computed from it.
  std::optional<Eigen::Vector3d> gravity_in_cam{};
};

// The tracking result of one image. Poses are camera-to-world, OpenCV axes (x right, y down, z
// forward), in the frame and unit of the map.
struct TrackingResult {
  int frame = 0;  // counted from 0 since the start, Load or Reset
  double timestamp = 0;
  TrackingState state = TrackingState::kLost;
  std::optional<Rigid3> world_from_cam;
  // `matched`: landmarks found; `inliers`: those that agree with the pose.
  int keypoints = 0, matched = 0, inliers = 0;
  // `detections`: all of this image; `objects`: mapped objects seen in it.
  int detections = 0, objects = 0;
  double confidence = 0;  // probability that the pose is right (RelocalizationResult)
  // Median depth of the landmarks that support the pose, map units; 0 without any.
  double depth = 0;
  // The number of the piece of map that the pose refers to. It changes where a camera that was lost
  // could not be found in its map and continues in a new one: poses with different numbers are in
  // different frames and units. Earlier pieces are kept, and joined once they are seen again.
  int piece = 0;
  double ms_total = 0, ms_features = 0, ms_track = 0, ms_objects = 0;
  double cpu_ms = 0;  // CPU time from image in to pose out; mapping not counted
};

// The result of finding one image in the map, independent of others.
struct RelocalizationResult {
  PoseEvidence evidence = PoseEvidence::kNone;  // the evidence for the pose; kNone: not found
  std::optional<Rigid3> world_from_cam;
  // In [0, 1]: how often the best hypothesis is right given this evidence, accepted or not.
  double confidence = 0;
  // Of the best hypothesis from objects, where objects were used.
  double object_score = 0, object_margin = 0;
  int inlier_points = 0, matched_objects = 0;
  double sigma_position = 0;  // map units, 1 sigma
  struct Candidate {
    Rigid3 world_from_cam;
    // Higher is better; comparable within one image. By points: the number of points that agree; by
    // objects: the statistic S (docs/objects.md).
    double score = 0;
  };
  // The best hypotheses. An accepted pose is the first, and no other has a higher score.
  std::vector<Candidate> candidates;
  std::string why_not;           // where no pose was found
  std::optional<Camera> camera;  // the camera that was found, where it was unknown
  double focal_sigma_px = 0;     // of that camera; 0 where it is one of the map's
  double ms_features = 0, ms = 0;
};

// Whether the images show a mapped object in its place.
struct ObjectPresence {
  uint32_t id = 0;
  int category_id = 0;
  int expected = 0,
      seen = 0;  // number of images that should have shown it in its place, and that did
  // It was moved or taken away: its detection rate does not explain how often it was not seen.
  bool is_missing = false;
};

// The content of the map, for display and for applications.
struct MapSnapshot {
  struct Object {
    uint32_t id = 0;
    int category_id = 0;
    Ellipsoid ellipsoid;
    int observations = 0;
  };
  std::vector<Rigid3> keyframes;  // world_from_cam
  std::vector<Eigen::Vector3d> landmarks;
  std::vector<Object> objects;
};

// Monocular SLAM with points and objects. Not thread-safe: it must be used by one thread at a time.
// Mapping runs on a thread of its own (runner.mode). Throws InputError, and changes nothing, for a
// configuration, image, detection or map file that cannot be used. If mapping fails (memory runs
// out), it ends, and the map stays as it was before. Process, and other functions that change the
// map, then throw std::runtime_error; Finish does so only if no other call has. All other functions
// still work: Export and Save give the map so far. Load and Reset begin anew.
class OASLAM_API Slam {
 public:
  Slam(const SlamConfig& config, const Camera& camera);
  ~Slam();
  Slam(Slam&&) noexcept;
  Slam& operator=(Slam&&) noexcept;

  // Tracks one image and extends the map. Time stamps must ascend: an image that is not newer than
  // the last throws InputError.
  TrackingResult Process(const ImageInput& input);

  // Adds detections of an image that was processed with `detections_follow`; `frame` is its
  // TrackingResult::frame. They are used at the pose that the image had. Images must ascend; images
  // that are skipped count as having none. Returns the number of mapped objects seen, or nothing
  // where the image is too old (4 s at 30 Hz) or had no pose. A lost camera that is found in that
  // image is tracked on from there.
  std::optional<int> AddDetections(int frame, const std::vector<Detection>& detections);

  // Finds one image in the map, independent of all others; the map is not changed.
  // `gravity_in_cam`: direction of gravity in the camera's frame, any length, where known; by
  // default that of the input.
  RelocalizationResult Relocalize(
      const ImageInput& input, RelocalizationMode mode,
      const std::optional<Eigen::Vector3d>& gravity_in_cam = std::nullopt);
  // The same for an image whose camera is unknown: as if a camera of the map had taken it, or with
  // a focal length estimated from its points. Of this Slam's camera only the image size is used.
  RelocalizationResult RelocalizeWithUnknownCamera(
      const ImageInput& input, RelocalizationMode mode,
      const std::optional<Eigen::Vector3d>& gravity_in_cam = std::nullopt);
  // The same by detections only.
  RelocalizationResult RelocalizeByObjects(
      const std::vector<Detection>& detections,
      const std::optional<Eigen::Vector3d>& gravity_in_cam = std::nullopt);
  // The same by the detections of successive images: what those of the last second told counts,
  // too. Time stamps (seconds) must ascend, as in Process. ForceRelocalization forgets them.
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

  // Gives up the present pose: the next image is relocalized.
  void ForceRelocalization();

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

  MapSnapshot Snapshot() const;

  // The poses of the frames given to Process, by time stamp, as of now: they move with the map.
  struct TimedPose {
    double timestamp = 0;
    Rigid3 world_from_cam;
  };
  std::vector<TimedPose> Trajectory() const;

  // Waits until everything seen is in the map, and optimises it a last time. Process may be called
  // again afterwards.
  void Finish();
  // The number (TrackingResult::piece) of the map: after Finish it may differ from
  // that of the last image.
  int MainPiece() const;
  // Writes the map with the trajectory so far.
  void Save(const std::string& path) const;
  // Replaces the map by that of a file; the next image is relocalized in it and may have any time
  // stamp. The file's camera may differ from this one. `piece`: selects the piece of a map with
  // several (0: the largest); the others are joined with it once images link them. The settings
  // stay (SetMapping, SetRelocalizationMode). If it throws, nothing has changed.
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
