#pragma once

#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// Every parameter of the system, with its default, unit and reason. A configuration file names them
// `section.key`; VisitFields below gives names and bounds. docs/configuration.md is made from this.

// How tracking and mapping take turns (docs/architecture.md). Sequential: mapping works inside
// Process. Lockstep: it has its own thread, and the results are the same on every run. Live: it has
// its own thread, and a camera does not wait for it.
enum class RunnerMode { kSequential, kLockstep, kLive };
// "sequential", "lockstep", "live".
OASLAM_API const char* ToString(RunnerMode mode);

// What detections of mapped objects constrain in bundle adjustment: nothing, the poses of
// keyframes, or these and the ellipsoids.
enum class BundleObjects { kNone, kPoses, kFull };

// Ours (docs/objects.md), or the paper's (docs/paper.md).
enum class ObjectMethod { kRobust, kPaper };

// Features are tracked by ORB's descriptors. Places are recognised by them, and where they fail by
// learned ones (train/README.md).
enum class DescriptorKind { kOrb, kLearnedAndOrb };

// ORB features of an image.
struct FeaturesConfig {
  int count = 1000;            // key points in an image, twice as many until there is a map: more
                               // hold on where texture is poor, and cost time in proportion
  double scale_factor = 1.2;   // between pyramid levels; eight levels cover a change of distance by
                               // 3.6
  int levels = 8;              // of the pyramid
  int resolution = 640;        // images with many more pixels than this x 3/4 of this are scaled
                               // down to so many, which saves time; results stay in pixels of the
                               // given image
  int fast_threshold = 20;     // least contrast of a corner, grey levels; lower ones are often
                               // noise
  int min_fast_threshold = 7;  // the same in cells where the first threshold finds nothing, so that
                               // dim parts of an image are used
  DescriptorKind descriptor = DescriptorKind::kLearnedAndOrb;  // by which places are recognised:
                                                               // learned+orb finds more from other
                                                               // sides and in other light, for 30
                                                               // ms of a keyframe and of an image
                                                               // that ORB does not find
};

// Tracking of the camera, and when an image becomes a keyframe.
struct TrackingConfig {
  int min_init_matches = 100;           // between the two views of the initialisation; the first
                                        // map has hardly more landmarks
  double min_init_parallax_deg = 2;     // angle between the rays of at least half of
                                        // `min_init_matches` points; below it depth is uncertain
                                        // (docs/lab/tracking.md)
  int min_inliers = 30;                 // landmarks that a pose needs; half of them do where they
                                        // are most of those that were matched
  int min_relocalization_inliers = 50;  // the same in the half second after a lost camera was
                                        // found
  double min_keyframe_interval = 0.1;   // seconds, unless much of the view is new; leaves time for
                                        // mapping
  double max_keyframe_interval = 1;     // seconds; the longest time between two keyframes, however
                                        // little the view changes
  double keyframe_inlier_ratio = 0.9;   // share of the reference keyframe's landmarks; an image
                                        // that sees fewer becomes a keyframe
  double max_object_sigma = 0.015;      // standard deviation of a position by objects alone,
                                        // divided by the distance; less certain poses are not in
                                        // the trajectory
  int reset_below_keyframes = 6;        // a camera that is lost in a map with fewer keyframes
                                        // begins a new one: so small a map is made again at once
};

// Keyframes and landmarks of the map.
struct MappingConfig {
  int covisible_neighbors = 20;      // keyframes that a new one is triangulated with and fused
                                     // with; the time grows with the number
  int min_shared_landmarks = 15;     // that join two keyframes in the covisibility graph
  double min_parallax_cos = 0.9998;  // rays with a larger cosine (1.1 degrees apart) are not
                                     // triangulated, since depth is uncertain
  double keyframe_redundancy = 0.9;  // a keyframe is removed where three others see this share of
                                     // its landmarks at the same scale
  bool loop_closing = true;          // whether the map is corrected where the camera returns to a
                                     // place
};

// Bundle adjustment around a new keyframe.
struct BundleConfig {
  int local_iterations = 10;                     // at most; it ends earlier where the error no
                                                 // longer falls
  int max_local_keyframes = 25;                  // keyframes that a local bundle adjustment moves;
                                                 // its time grows with the number
  BundleObjects objects = BundleObjects::kNone;  // poses: detections of mapped objects constrain
                                                 // keyframes; full: the ellipsoids, too. Neither
                                                 // makes trajectories clearly better
                                                 // (docs/lab/objects.md)
};

// From detections to the ellipsoids of the map.
struct ObjectsConfig {
  ObjectMethod model = ObjectMethod::kRobust;  // paper: Wasserstein distance, 9 degrees of freedom;
                                               // robust: docs/objects.md
  double min_score = 0.5;                      // detections at or below are not mapped
  double min_iou_box = 0.3;                    // least overlap of a detection with the track's last
                                               // box, for it to be of that track
  double min_iou_projection = 0.2;             // least overlap with the track's projected
                                               // ellipsoid, which fits less tightly than a box
  int min_shared_points = 10;                  // tau of the paper: landmarks in both boxes that
                                               // make a detection one of the track
  double max_box_age_s = 0.5;                  // an older last box is not compared, unless it is of
                                               // the image before: the view has changed since
  double drop_after_s = 2;                     // a track without an ellipsoid is dropped after so
                                               // long, and five images, in which it is not seen
  double min_parallax_deg = 10;                // angle between views that the first ellipsoid
                                               // needs; 5 gave many false ones in one of three runs
                                               // (docs/lab/objects.md)
  int min_observations = 20;                   // detections in a video of 30 Hz before an object is
                                               // mapped (in slower ones each counts for up to six);
                                               // 40 found fewer objects, 10 more false ones
                                               // (docs/lab/rooms.md)
  double min_accept_iou = 0.3;                 // least overlap of projection and detection that
                                               // counts as agreement, before an object is mapped
  double min_accept_share = 0.9;               // share of the observations that must agree, before
                                               // an object is mapped; 1 in the paper, where one bad
                                               // box is enough to refuse it
  double fusion_iou = 0.2;                     // objects whose boxes in space overlap more are one
};

// Finding a camera that is lost, by points and by objects.
struct RelocalizationConfig {
  ObjectMethod objects = ObjectMethod::kRobust;  // paper: P3P on the centres of all triplets, the
                                                 // best overlap, always accepted (docs/paper.md);
                                                 // robust: docs/objects.md
  double min_score = 0.3;                        // detections below are not used; lower than in
                                                 // mapping, since a false detection leaves nothing
                                                 // in the map
  int max_detections = 24;                       // the ones with the best scores; the time grows
                                                 // with the number of triplets
  int ransac_iterations = 300;                   // of P3P on matched points, at most
  double accept_margin = 5;                      // least difference of the statistic S
                                                 // (docs/objects.md) from that of the best pose
                                                 // elsewhere
  double accept_evidence = 34;                   // least S / 2 + margin, 15/17 of it with gravity;
                                                 // accepts at most 0.5 % in wrong maps
                                                 // (docs/lab/relocalization.md)
  int accept_objects = 4;                        // matched ones; one fewer with gravity, which
                                                 // leaves a pose fewer unknowns
  double accept_confidence = 0.95;               // least probability that a pose is
                                                 // right (docs/lab/relocalization.md)
};

// How tracking and mapping run.
struct RunnerConfig {
  RunnerMode mode = RunnerMode::kLockstep;  // sequential, lockstep, live (RunnerMode)
  int lag = 2;                              // lockstep: the tracker of frame k sees the map of
                                            // frame k - lag; more lets mapping take longer, and the
                                            // tracker sees an older map
  int seed = 0;                             // of all random numbers: the same seed gives the same
                                            // results, but in live mode
};

// All parameters, in sections; docs/configuration.md lists them. Take Live for an application with
// a camera and Offline for recordings.
struct SlamConfig {
  // For an application that shows what a camera sees: it does not wait for mapping.
  OASLAM_API static SlamConfig Live();
  // For recordings: mapping keeps up with the images, however fast these come, and the result is
  // the same on every run. These are the defaults.
  OASLAM_API static SlamConfig Offline();

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
  visit("features.descriptor", c.features.descriptor, Words{"orb", "learned+orb"});
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
  visit("relocalization.accept_confidence", c.relocalization.accept_confidence, 0.5, 0.9999);
  visit("runner.mode", c.runner.mode, Words{"sequential", "lockstep", "live"});
  visit("runner.lag", c.runner.lag, 1, 1000);
  visit("runner.seed", c.runner.seed, 0, 2147483647);
}

}  // namespace oaslam
