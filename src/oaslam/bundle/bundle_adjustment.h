#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <utility>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// What a bundle adjustment would change in the map it read.
struct BundleCorrection {
  bool success = false;  // false: nothing to optimise, or the solver failed; the rest is empty
  std::vector<std::pair<KeyframeId, Rigid3>> poses;            // cam_from_world, ascending
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> points;  // ascending
  std::vector<std::pair<ObjectId, Ellipsoid>> objects;  // ascending; where bundle.objects is "full"
  std::vector<std::pair<LandmarkId, KeyframeId>> outliers;  // observations to erase
  double initial_cost = 0,
         final_cost =
             0;  // half the sum of Huber's kernel of chi^2, over the same points' observations
  int iterations = 0;
};

// Of `newest` and its most covisible keyframes with all landmarks they see; other observers and the
// map's first keyframe hold the gauge. Two stages: with Huber's kernel; then, if there are more
// than a few outliers (chi^2 > 5.991, or behind the camera), without both. `config.objects` adds
// the boxes of mapped objects (paper, section "Integrating Objects in Bundle Adjustment"); the
// kernel stays on these.
BundleCorrection LocalBundleAdjustment(const Map& map, KeyframeId newest,
                                       const BundleConfig& config);

// Of everything; the first keyframe stays. Asked to stop, it ends with the iteration that it is in,
// unsuccessful.
BundleCorrection GlobalBundleAdjustment(const Map& map, int iterations, const BundleConfig& config,
                                        const std::stop_token& stop = {});

// Writes a correction into the map: what is no longer there is skipped. Covisibility is left to the
// caller.
void ApplyCorrection(const BundleCorrection& correction, Map& map);

// The same for a correction of an earlier state of the map: keyframes and landmarks that came since
// move along with their neighbours of then.
void ApplyLateCorrection(const BundleCorrection& correction, const Map& corrected, Map& map);

}  // namespace oaslam
