#pragma once

#include <vector>

#include "oaslam/map/relocalization.h"
#include "oaslam/relocalization/object_scene.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Whether the camera centres are farther apart than `distance` or the rotations differ by
// more than `angle_rad`.
bool AreDifferent(const Rigid3& a, const Rigid3& b, double distance, double angle_rad);

// Guesses, scored by ObjectScene::ScorePose, from pairs (with a known vertical) and triplets of
// detections whose sizes are compatible with the distances between their objects. Each group
// contains one of three chosen detections, so that the number of guesses does not grow with the
// cube of the map. Chosen are detections that no border cuts, and of these the ones whose classes
// have the fewest objects.
std::vector<PoseHypothesis> GuessFromGroups(const ObjectScene& scene, Rng& rng);

// Guesses from single detections, over a grid of camera orientations; in a large map only from
// those with which most other detections are compatible. Empty unless the map knows its vertical.
std::vector<PoseHypothesis> GuessFromSingles(const ObjectScene& scene);

// The best `count` guesses that differ from each other.
std::vector<PoseHypothesis> SelectDistinct(std::vector<PoseHypothesis> guesses, size_t count);

}  // namespace oaslam
