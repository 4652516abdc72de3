#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"
#include "oaslam/matching/place_index.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/relocalization/report.h"
#include "oaslam/slam.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Where a frame is in the map, and what stands for it.
struct Relocalization {
  PoseEvidence evidence = PoseEvidence::kNone;
  Rigid3 cam_from_world;              // valid unless evidence is kNone
  std::vector<LandmarkId> landmarks;  // per key point, where points stand for the pose
  int inliers = 0;
  int matched_objects = 0;
  double sigma_position = 0;  // map units
  double relative_sigma =
      0;                  // of an object-only pose: sigma_position over the distance to its objects
  double confidence = 0;  // [0, 1], of the best hypothesis, also where evidence is kNone
  double object_score = 0, object_margin = 0;  // of the best hypothesis from objects
  std::vector<PoseHypothesis> candidates;  // best first; where a pose is accepted, it is the first
  std::string why_not;                     // where evidence is kNone
};

// The same for a frame whose camera is not known.
struct UnknownCameraRelocalization {
  Relocalization found;
  Camera camera;  // a camera of the map, or one with the focal length that the points ask for
  double relative_sigma = 0;  // of that focal length; 0 where it is a camera of the map
};

// Finds frames in a map, each by itself (paper, section "Relocalization using Objects"): by points;
// where these fail, by objects, whose pose guides the search for points; and by objects alone as a
// last resort, if their evidence is strong.
class Relocalizer {
 public:
  explicit Relocalizer(const SlamConfig& config) : config_(config) {}

  // `gravity_in_cam`: direction of gravity in the camera's frame, where known. A frame without
  // features is found by objects only.
  Relocalization Find(const Frame& frame, const Map& map, RelocalizationMode mode,
                      const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng);

  // Of a frame in its original image, whose camera in the map is without distortion and of its
  // size, else arbitrary: first as if one of the map's cameras had taken it; where points
  // contradict that, or find nothing, with a focal length of its own.
  UnknownCameraRelocalization FindWithUnknownCamera(
      const Frame& raw, const Map& map, RelocalizationMode mode,
      const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng);

 private:
  Relocalization ByPoints(const Frame& frame, const Map& map, bool join_objects, Rng& rng);
  // A pose on few points, which its objects make better. (Not in the paper, which refines on
  // points.)
  Relocalization JoinObjects(const Frame& frame, const Map& map,
                             const RelocalizationReport& by_points, PoseEvidence evidence) const;
  std::vector<ObjectPoseCandidate> CandidatesByObjects(
      const Frame& frame, const Map& map, const std::optional<Eigen::Vector3d>& gravity_in_cam,
      Rng& rng) const;
  // The paper's poses say nothing of how sure they are: 0.
  double ConfidenceIn(const ObjectPoseCandidate& candidate) const;
  bool IsAsInPaper() const { return config_.relocalization.objects == "paper"; }
  Relocalization ByObjects(const Frame& frame, const Map& map, bool confirm_by_points,
                           const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng) const;
  const PlaceIndex& IndexOf(const Map& map);
  static void LeadWithAccepted(Relocalization& found);

  // An index of places and the landmarks that it was made of.
  struct IndexedLandmarks {
    Table<LandmarkId, Landmark> landmarks;
    PlaceIndex index;
  };

  SlamConfig config_;
  std::optional<IndexedLandmarks> indexed_;
};

}  // namespace oaslam
