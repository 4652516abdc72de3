#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/localization/landmark_index.h"
#include "oaslam/map/map.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/object_trails.h"
#include "oaslam/relocalization/report.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// The pose of a frame in the map, with its evidence.
struct Relocalization {
  PoseEvidence evidence = PoseEvidence::kNone;
  Rigid3 cam_from_world;              // valid unless evidence is kNone
  std::vector<LandmarkId> landmarks;  // by key point; empty where objects alone support the pose
  int inliers = 0;
  int matched_objects = 0;
  // Where points confirm objects: whether the objects alone would be enough evidence.
  bool objects_suffice = false;
  double sigma_position = 0;  // map units
  // Of the pose by objects, before points are joined: sigma of its position divided by the mean
  // distance to its objects.
  double relative_sigma = 0;
  double confidence = 0;                       // [0, 1], of the best hypothesis, accepted or not
  double object_score = 0, object_margin = 0;  // of the best hypothesis from objects
  std::vector<PoseHypothesis> candidates;      // best first; an accepted pose is the first
  PoseEvidence candidates_are_by = PoseEvidence::kNone;  // kPoints or kObjects: whose scores
  std::string why_not;                                   // where evidence is kNone
};

// The same for a frame whose camera is unknown.
struct UnknownCameraRelocalization {
  Relocalization found;
  Camera camera;  // a camera of the map, or one whose focal length was estimated from the points
  double relative_sigma = 0;  // of an estimated focal length; 0 for a camera of the map
};

// Finds frames in a map, independently of each other (paper, section "Relocalization using
// Objects"): by points; where these fail, by objects, whose pose guides the search for points; and
// by objects alone as a last resort, if their evidence is strong.
class Relocalizer {
 public:
  // `index`: of a map in which frames will be found; made at need for any other map.
  explicit Relocalizer(const SlamConfig& config,
                       std::shared_ptr<const LandmarkIndex> index = nullptr)
      : config_(config), index_(std::move(index)) {}

  // Uses an index of the map that was made elsewhere.
  void Use(std::shared_ptr<const LandmarkIndex> index) { index_ = std::move(index); }

  // `gravity_in_cam`: direction of gravity in the camera's frame, where known. A frame without
  // features is found by objects only. `trails`: the evidence of objects in earlier frames, which
  // counts, too (not by the paper's method); null to find each frame by itself. `prior`: the
  // camera's supposed pose, world_from_cam; landmarks are looked for around it first.
  Relocalization Find(const Frame& frame, const Map& map, RelocalizationMode mode,
                      const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng,
                      ObjectTrails* trails = nullptr,
                      const std::optional<Rigid3>& prior = std::nullopt);

  // Finds a frame whose camera is not known. `raw` holds key points and boxes of the original
  // image, and its camera in `map` gives the image's size and has no distortion; the focal length
  // of that camera is not used. First tries each camera of the map that fits the image's size.
  // Where the points contradict it, or nothing is found, estimates the focal length together with
  // the pose.
  UnknownCameraRelocalization FindWithUnknownCamera(
      const Frame& raw, const Map& map, RelocalizationMode mode,
      const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng);

 private:
  // Nothing where landmarks do not confirm the pose.
  std::optional<Relocalization> Near(const Rigid3& world_from_cam, const Frame& frame,
                                     const Map& map, Rng& rng) const;
  using CandidateSource = std::function<const std::vector<ObjectPoseCandidate>&()>;
  // By points that are compared by `appearance`, then by objects, which points confirm.
  Relocalization FindBy(Appearance appearance, const Frame& frame, const Map& map,
                        RelocalizationMode mode, Rng& rng, const CandidateSource& candidates);
  Relocalization ByPoints(const Frame& frame, const Map& map, bool join_objects,
                          Appearance appearance, Rng& rng);
  // Refines a pose that few points support by the objects in view. (Not in the paper, which refines
  // with points.)
  Relocalization JoinObjects(const Frame& frame, const Map& map,
                             const RelocalizationReport& by_points, PoseEvidence evidence) const;
  std::vector<ObjectPoseCandidate> CandidatesByObjects(
      const Frame& frame, const Map& map, const std::optional<Eigen::Vector3d>& gravity_in_cam,
      Rng& rng, ObjectTrails* trails) const;
  // 0 for poses by the paper's method, which have no confidence.
  double ConfidenceIn(const ObjectPoseCandidate& candidate) const;
  bool IsAsInPaper() const { return config_.relocalization.objects == ObjectMethod::kPaper; }
  Relocalization ByObjects(const Frame& frame, const Map& map, bool confirm_by_points,
                           const std::vector<ObjectPoseCandidate>& candidates, Rng& rng) const;
  const PlaceIndex& IndexOf(const Map& map);
  static void LeadWithAccepted(Relocalization& found);

  SlamConfig config_;
  std::shared_ptr<const LandmarkIndex> index_;  // null: none yet
};

}  // namespace oaslam
