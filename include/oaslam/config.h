#pragma once

#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// Every parameter of the system: its default, its unit and why. A configuration file names them
// `section.key` ; VisitFields below binds names and bounds.

// How tracking and mapping take turns (docs/architecture.md). Sequential: mapping works inside
// Process. Lockstep: on a thread of its own, with the same results on every run. Live: on a thread
// of its own, for a camera that does not wait.
enum class RunnerMode { kSequential, kLockstep, kLive };
// "sequential", "lockstep", "live".
OASLAM_API const char* ToString(RunnerMode mode);

// What detections of mapped objects pull at in bundle adjustments: nothing, keyframes, or keyframes
// and the ellipsoids.
enum class BundleObjects { kNone, kPoses, kFull };

// The methods of the paper (docs/paper.md), or ours (docs/objects.md).
enum class ObjectMethod { kRobust, kPaper };

// Key points.
struct FeaturesConfig {
  int count = 1000;           // key points a frame (doubled until initialised)
  double scale_factor = 1.2;  // between pyramid levels
  int levels = 8;
  int resolution = 640;  // images with many more pixels than this x 3/4 of this are scaled down to
                         // so many; results stay in pixels of the given image
  int fast_threshold = 20;     // grey levels
  int min_fast_threshold = 7;  // in cells where the first finds nothing
};

// Initialisation, tracking, and the choice of keyframes.
struct TrackingConfig {
  int min_init_matches = 100;        // between the two views of the initialisation
  double min_init_parallax_deg = 2;  // that half of `min_init_matches` points have
  int min_inliers =
      30;  // landmarks that a pose needs; 15 do where they are most of those that were matched
  int min_relocalization_inliers = 50;  // the same to find the camera, and half a second after it
  double min_keyframe_interval = 0.1;   // seconds, unless much of the view is new
  double max_keyframe_interval = 1;     // seconds
  double keyframe_inlier_ratio = 0.9;  // of the reference keyframe's landmarks; fewer: new keyframe
  double max_object_sigma =
      0.015;  // of the distance: an object-only pose less certain is no part of a trajectory
  int reset_below_keyframes = 6;  // lost with a smaller map: start anew
};

// Landmarks and keyframes.
struct MappingConfig {
  int covisible_neighbors = 20;      // keyframes to triangulate with and to fuse with
  int min_shared_landmarks = 15;     // an edge of the covisibility graph
  double min_parallax_cos = 0.9998;  // rays closer than this are not triangulated
  double keyframe_redundancy =
      0.9;  // share of landmarks seen by 3 others at the same scale: redundant
  bool loop_closing = true;
};

// Bundle adjustment.
struct BundleConfig {
  int local_iterations = 10;
  int max_local_keyframes = 25;                  // free keyframes of a local bundle adjustment
  BundleObjects objects = BundleObjects::kNone;  // poses: detections of mapped objects pull at
                                                 // keyframes; full: and at the ellipsoids
};

// From detections to objects of the map.
struct ObjectsConfig {
  ObjectMethod model = ObjectMethod::kRobust;  // paper: Wasserstein distance, 9 dof; robust:
                                               // docs/objects.md
  double min_score = 0.5;                      // detections at or below are not mapped
  double min_iou_box = 0.3;                    // association gate, last box
  double min_iou_projection = 0.2;             // association gate, projected ellipsoid
  int min_shared_points = 10;                  // tau: association by landmarks
  double max_box_age_s =
      0.5;  // a last box older than this says nothing, unless it is of the image before
  double drop_after_s =
      2;  // an unreconstructed track unseen for longer, and in five images, is dropped
  double min_parallax_deg = 10;  // first ellipsoid
  int min_observations = 20;    // insertion into the map: detections in a video of 30 Hz; in slower
                                // ones each counts for up to six
  double min_accept_iou = 0.3;  // insertion: overlap of projection and detection
  double min_accept_share =
      0.9;                  // insertion: share of observations with that overlap (1 in the paper)
  double fusion_iou = 0.2;  // duplicates: IoU of the 3-D boxes
};

// Finding a lost camera by objects.
struct RelocalizationConfig {
  ObjectMethod objects = ObjectMethod::kRobust;  // paper: P3P on the centres of all triplets, the
                                                 // best overlap, always accepted (docs/paper.md);
                                                 // robust: docs/objects.md
  double min_score = 0.3;                        // detections below are not used
  int max_detections = 24;
  int ransac_iterations = 300;
  double accept_margin = 5;  // statistic S (docs/objects.md) less that of the best pose elsewhere
  double accept_evidence = 34;  // S / 2 + margin; 15/17 of it with gravity (tools/acceptance)
  int accept_objects = 4;       // matched ones; one fewer with gravity
  int min_matches = 30;         // guided points that confirm an object pose
};

// How tracking and mapping take turns.
struct RunnerConfig {
  RunnerMode mode = RunnerMode::kLockstep;
  int lag = 2;  // lockstep: the tracker of frame k sees the map of frame k - lag
  int seed = 0;
};

// All parameters, in the sections of a configuration file.
struct SlamConfig {
  FeaturesConfig features;
  TrackingConfig tracking;
  MappingConfig mapping;
  BundleConfig bundle;
  ObjectsConfig objects;
  RelocalizationConfig relocalization;
  RunnerConfig runner;

  // All problems at once, each "section.key: value, allowed: bound"; empty when valid.
  OASLAM_API std::vector<std::string> Validate() const;
};

// Calls visit(name, value&, min, max) for numbers, and visit(name, value&, words) for enumerations
// and bool, whose values are named by `words` in order.
template <typename Config, typename Visitor>
void VisitFields(Config& c, Visitor&& visit) {
  using Words = std::vector<std::string>;
  visit("features.count", c.features.count, 100, 20000);
  visit("features.scale_factor", c.features.scale_factor, 1.05, 2.0);
  visit("features.levels", c.features.levels, 1, 16);
  visit("features.resolution", c.features.resolution, 80, 20000);
  visit("features.fast_threshold", c.features.fast_threshold, 1, 255);
  visit("features.min_fast_threshold", c.features.min_fast_threshold, 1, 255);
  visit("tracking.min_init_matches", c.tracking.min_init_matches, 20, 10000);
  visit("tracking.min_init_parallax_deg", c.tracking.min_init_parallax_deg, 0.1, 45.0);
  visit("tracking.min_inliers", c.tracking.min_inliers, 6, 1000);
  visit("tracking.min_relocalization_inliers", c.tracking.min_relocalization_inliers, 6, 1000);
  visit("tracking.min_keyframe_interval", c.tracking.min_keyframe_interval, 0.0, 1000.0);
  visit("tracking.max_keyframe_interval", c.tracking.max_keyframe_interval, 0.0, 1000.0);
  visit("tracking.keyframe_inlier_ratio", c.tracking.keyframe_inlier_ratio, 0.1, 1.0);
  visit("tracking.max_object_sigma", c.tracking.max_object_sigma, 0.0, 1.0);
  visit("tracking.reset_below_keyframes", c.tracking.reset_below_keyframes, 0, 1000);
  visit("mapping.covisible_neighbors", c.mapping.covisible_neighbors, 1, 100);
  visit("mapping.min_shared_landmarks", c.mapping.min_shared_landmarks, 1, 1000);
  visit("mapping.min_parallax_cos", c.mapping.min_parallax_cos, 0.5, 0.999999);
  visit("mapping.keyframe_redundancy", c.mapping.keyframe_redundancy, 0.5, 1.0);
  visit("mapping.loop_closing", c.mapping.loop_closing, Words{"off", "on"});
  visit("bundle.local_iterations", c.bundle.local_iterations, 1, 1000);
  visit("bundle.max_local_keyframes", c.bundle.max_local_keyframes, 2, 1000);
  visit("bundle.objects", c.bundle.objects, Words{"none", "poses", "full"});
  visit("objects.model", c.objects.model, Words{"robust", "paper"});
  visit("objects.min_score", c.objects.min_score, 0.0, 1.0);
  visit("objects.min_iou_box", c.objects.min_iou_box, 0.0, 1.0);
  visit("objects.min_iou_projection", c.objects.min_iou_projection, 0.0, 1.0);
  visit("objects.min_shared_points", c.objects.min_shared_points, 1, 1000);
  visit("objects.max_box_age_s", c.objects.max_box_age_s, 0.0, 1e6);
  visit("objects.drop_after_s", c.objects.drop_after_s, 0.0, 1e6);
  visit("objects.min_parallax_deg", c.objects.min_parallax_deg, 0.1, 90.0);
  visit("objects.min_observations", c.objects.min_observations, 3, 100000);
  visit("objects.min_accept_iou", c.objects.min_accept_iou, 0.0, 1.0);
  visit("objects.min_accept_share", c.objects.min_accept_share, 0.0, 1.0);
  visit("objects.fusion_iou", c.objects.fusion_iou, 0.0, 1.0);
  visit("relocalization.objects", c.relocalization.objects, Words{"robust", "paper"});
  visit("relocalization.min_score", c.relocalization.min_score, 0.0, 1.0);
  visit("relocalization.max_detections", c.relocalization.max_detections, 3, 200);
  visit("relocalization.ransac_iterations", c.relocalization.ransac_iterations, 10, 100000);
  visit("relocalization.accept_margin", c.relocalization.accept_margin, 0.0, 1e6);
  visit("relocalization.accept_evidence", c.relocalization.accept_evidence, 0.0, 1e6);
  visit("relocalization.accept_objects", c.relocalization.accept_objects, 3, 1000);
  visit("relocalization.min_matches", c.relocalization.min_matches, 10, 1000);
  visit("runner.mode", c.runner.mode, Words{"sequential", "lockstep", "live"});
  visit("runner.lag", c.runner.lag, 1, 1000);
  visit("runner.seed", c.runner.seed, 0, 2147483647);
}

}  // namespace oaslam
