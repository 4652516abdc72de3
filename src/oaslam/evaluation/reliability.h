#pragma once

#include <span>
#include <string>
#include <vector>

#include "oaslam/evaluation/relocalization_metrics.h"

namespace oaslam {

// The best hypothesis of a frame, accepted or not, and its error. It is right if the error is below
// kFalseDistance and kFalseRotationDeg.
struct HypothesisError {
  double confidence = 0;  // as reported by the program
  PoseError error;
};

// `hypotheses`: the first of each time stamp is used. `confidences`: time stamp and confidence of
// each frame.
std::vector<HypothesisError> CompareHypotheses(
    const std::vector<StampedPose>& groundtruth, const std::vector<ScoredPose>& hypotheses,
    const std::vector<std::pair<double, double>>& confidences,
    const Alignment& groundtruth_from_map);

// "timestamp,confidence,position_error_m,rotation_error_deg" in each line. Throws InputError.
void SaveHypothesisErrors(const std::string& path, std::span<const HypothesisError> hypotheses);

}  // namespace oaslam
