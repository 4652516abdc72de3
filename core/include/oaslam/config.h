#pragma once

#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// The settings of the library, each with its default, unit and reason. A configuration file names a
// setting `section.key`; VisitFields below gives names and bounds. tools/configuration_md.py makes
// docs/configuration.md from this file.

// How tracking and mapping take turns (docs/architecture.md). Sequential: mapping works inside
// Process. Lockstep: it has its own thread, and the results are the same on every run. Live: it has
// its own thread, and a camera does not wait for it.
enum class RunnerMode { kSequential, kLockstep, kLive };
// "sequential", "lockstep", "live".
OASLAM_API const char* ToString(RunnerMode mode);

// What detections of mapped objects constrain in bundle adjustment: nothing, the poses of
// keyframes, or these and the ellipsoids.
enum class BundleObjects { kNone, kPoses, kFull };

// The method for objects: kRobust is this library's (docs/objects.md), kPaper that of the OA-SLAM
// paper (docs/paper.md).
enum class ObjectMethod { kRobust, kPaper };

// The tracker always uses ORB's descriptors. Place recognition uses them, too; with kLearnedAndOrb
// it tries learned descriptors where ORB fails (train/README.md).
enum class DescriptorKind { kOrb, kLearnedAndOrb };

// ORB features of an image.
struct FeaturesConfig {
  int count = 1000;      // key points in an image, twice as many until there is a map: more of them
                         // keep tracking where texture is poor, and cost time in proportion
  int resolution = 640;  // width of a 4:3 image: images with many more pixels than it has are
                         // scaled down to its number of pixels, which saves time; results stay in
                         // pixels of the given image
  DescriptorKind descriptor = DescriptorKind::kLearnedAndOrb;  // descriptors that recognise places:
                                                               // learned+orb recognises more of
                                                               // them from another viewpoint or in
                                                               // other light, and takes 30 ms for a
                                                               // keyframe and for an image that ORB
                                                               // does not find
};

// Tracking of the camera.
struct TrackingConfig {
  int min_inliers = 30;             // inlier landmarks that a pose needs, at least 15; 15 suffice
                                    // where more than half of the matched landmarks are inliers
  double max_object_sigma = 0.015;  // standard deviation of a position by objects alone,
                                    // divided by the distance; less certain poses are not in
                                    // the trajectory
};

// The map.
struct MappingConfig {
  bool loop_closing = true;  // whether the map is corrected where the camera returns to a
                             // place
};

// Bundle adjustment.
struct BundleConfig {
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
  double min_parallax_deg = 10;                // angle between views that the first ellipsoid
                                               // needs; 5 gave many false ones in one of three runs
                                               // (docs/lab/objects.md)
  int min_observations = 20;                   // detections in a video of 30 Hz before an object is
                                               // mapped (in slower ones each counts for up to six);
                                               // 40 found fewer objects, 10 more false ones
                                               // (docs/lab/rooms.md)
  double min_accept_share = 0.9;               // share of the observations that must agree, before
                                               // an object is mapped; 1 in the paper, where one bad
                                               // box is enough to refuse it
};

// Finding a camera that is lost, by points and by objects.
struct RelocalizationConfig {
  ObjectMethod objects = ObjectMethod::kRobust;  // paper: P3P on the centres of all triplets, the
                                                 // best overlap, always accepted (docs/paper.md);
                                                 // robust: docs/objects.md
  double min_score = 0.3;                        // detections below are not used; lower than in
                                                 // mapping, since a false detection leaves nothing
                                                 // in the map
  double accept_margin = 5;                      // least difference of the statistic S
                                                 // (docs/objects.md) from that of the best pose
                                                 // elsewhere
  double accept_evidence = 34;                   // least value of S / 2 + margin, 15/17 of it where
                                                 // gravity is measured; at most 0.5 % of images get
                                                 // a pose in a wrong map
                                                 // (docs/lab/relocalization.md)
  int accept_objects = 4;                        // least number of matched objects; one fewer where
                                                 // gravity is measured, which leaves a pose fewer
                                                 // unknowns
  double accept_confidence = 0.95;               // least probability that a pose is
                                                 // right (docs/lab/relocalization.md)
};

// How tracking and mapping run.
struct RunnerConfig {
  RunnerMode mode = RunnerMode::kLockstep;  // sequential, lockstep, live (RunnerMode)
  int lag = 2;                              // lockstep: the tracker of frame k sees the map of
                                            // frame k - lag; more lets mapping take longer, and the
                                            // tracker sees an older map
  int seed = 0;                             // seed of all random numbers: the same seed gives the
                                            // same results, except in live mode
};

// All parameters, in sections; docs/configuration.md lists them. Live or Offline makes one:
//
//   SlamConfig config = SlamConfig::Live();
//   config.features.count = 1500;
//   Slam slam(config, camera);
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

 private:
  // The constructor is private, so that every application chooses Live or Offline.
  SlamConfig() = default;
};

// Calls visit(name, value&, min, max) for numbers, and visit(name, value&, words) for enumerations
// and bool, whose values are named by `words` in order.
template <typename Config, typename Visitor>
void VisitFields(Config& c, Visitor&& visit) {
  using Words = std::vector<std::string>;
  visit("features.count", c.features.count, 100, 20000);
  visit("features.resolution", c.features.resolution, 80, 20000);
  visit("features.descriptor", c.features.descriptor, Words{"orb", "learned+orb"});
  visit("tracking.min_inliers", c.tracking.min_inliers, 6, 1000);
  visit("tracking.max_object_sigma", c.tracking.max_object_sigma, 0.0, 1.0);
  visit("mapping.loop_closing", c.mapping.loop_closing, Words{"off", "on"});
  visit("bundle.objects", c.bundle.objects, Words{"none", "poses", "full"});
  visit("objects.model", c.objects.model, Words{"robust", "paper"});
  visit("objects.min_score", c.objects.min_score, 0.0, 1.0);
  visit("objects.min_parallax_deg", c.objects.min_parallax_deg, 0.1, 90.0);
  visit("objects.min_observations", c.objects.min_observations, 3, 100000);
  visit("objects.min_accept_share", c.objects.min_accept_share, 0.0, 1.0);
  visit("relocalization.objects", c.relocalization.objects, Words{"robust", "paper"});
  visit("relocalization.min_score", c.relocalization.min_score, 0.0, 1.0);
  visit("relocalization.accept_margin", c.relocalization.accept_margin, 0.0, 1e6);
  visit("relocalization.accept_evidence", c.relocalization.accept_evidence, 0.0, 1e6);
  visit("relocalization.accept_objects", c.relocalization.accept_objects, 3, 1000);
  visit("relocalization.accept_confidence", c.relocalization.accept_confidence, 0.5, 0.9999);
  visit("runner.mode", c.runner.mode, Words{"sequential", "lockstep", "live"});
  visit("runner.lag", c.runner.lag, 1, 1000);
  visit("runner.seed", c.runner.seed, 0, 2147483647);
}

}  // namespace oaslam
