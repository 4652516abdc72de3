#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <utility>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/map/map.h"

namespace oaslam {

// The changes that a bundle adjustment proposes for the map it read.
struct BundleCorrection {
  bool success = false;  // false: nothing to optimise, or the solver failed; the rest is empty
  std::vector<std::pair<KeyframeId, Rigid3>> poses;            // cam_from_world, ascending
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> points;  // ascending
  std::vector<std::pair<ObjectId, Ellipsoid>> objects;  // ascending; where bundle.objects is full
  std::vector<std::pair<LandmarkId, KeyframeId>> outliers;  // observations to erase
  int iterations = 0;
};

// Adjusts `newest`, its most covisible keyframes, and all landmarks that these keyframes see. The
// map's first keyframe and all other keyframes that see these landmarks are fixed. Two stages: the
// first with Huber's kernel; the second, if there are more than a few outliers (chi^2 > 5.991, or
// behind the camera), without kernel and without outliers. `config.objects` adds the boxes of
// mapped objects (paper, section "Integrating Objects in Bundle Adjustment"), which always have the
// kernel. The time grows with `max_keyframes`, the number of keyframes that are not fixed.
BundleCorrection LocalBundleAdjustment(const Map& map, KeyframeId newest,
                                       const BundleConfig& config, int max_keyframes = 25);

// Adjusts the whole map with the first keyframe fixed. When a stop is requested, it ends after the
// present iteration, without success.
BundleCorrection GlobalBundleAdjustment(const Map& map, int iterations, const BundleConfig& config,
                                        const std::stop_token& stop = {});

// The keyframes of the map in parts that are adjusted one after another, the newest first: all in
// one in a small map, else a bounded number each, so that the time and the memory of an adjustment
// do not grow with the map.
std::vector<std::vector<KeyframeId>> AdjustmentWindows(const Map& map);

// Adjusts the keyframes of a window (ascending) and all landmarks they see; the other keyframes
// that see most of these, and the map's first keyframe, are fixed. A window of all keyframes is a
// global bundle adjustment. `stop`: as for GlobalBundleAdjustment.
BundleCorrection WindowBundleAdjustment(const Map& map, const std::vector<KeyframeId>& window,
                                        int iterations, const BundleConfig& config,
                                        const std::stop_token& stop = {});

// Applies a correction to the map; keyframes, landmarks and objects that no longer exist are
// skipped. The caller must update the covisibility.
void ApplyCorrection(const BundleCorrection& correction, Map& map);

// Applies a correction that was computed from an earlier state of the map, `corrected`: keyframes
// and landmarks that were added after that state move with their neighbours in `corrected`.
void ApplyLateCorrection(const BundleCorrection& correction, const Map& corrected, Map& map);

}  // namespace oaslam
