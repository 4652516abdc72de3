#pragma once

#include <array>
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

// The hypotheses whose confidence is in one tenth of [0, 1], and how many of them are right.
struct ReliabilityBin {
  size_t count = 0;
  double mean_confidence = 0, share_right = 0;
};

struct Reliability {
  std::array<ReliabilityBin, 10> bins;
  size_t count = 0;
  double brier = 0;  // mean squared difference between confidence and right (1) or wrong (0)
  // Mean over the hypotheses of |mean confidence - share right| of their bin.
  double calibration_error = 0;
};

Reliability SummarizeReliability(std::span<const HypothesisError> hypotheses);

// "timestamp,confidence,position_error_m,rotation_error_deg" in each line. Both throw InputError.
void SaveHypothesisErrors(const std::string& path, std::span<const HypothesisError> hypotheses);
std::vector<HypothesisError> LoadHypothesisErrors(const std::string& path);

}  // namespace oaslam
