#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "oaslam/evaluation/alignment.h"

namespace oaslam {

// Errors of the poses that a relocalization reports, for all frames it was asked about.
struct RelocalizationErrors {
  std::string name;
  size_t frames = 0;             // with ground truth
  std::vector<PoseError> poses;  // of frames with an answer and ground truth
};

// `frame_times`: of all frames it was asked about, ascending.
RelocalizationErrors CompareRelocalization(const std::vector<StampedPose>& groundtruth,
                                           const std::vector<StampedPose>& poses,
                                           const std::vector<double>& frame_times,
                                           const Alignment& groundtruth_from_map);

constexpr std::array kRecallDistances = {
    0.05, 0.1, 0.2, 0.3, 0.5, 1.0};           // metres; content on a desk needs the first ones
constexpr double kRecallMaxRotationDeg = 15;  // a larger error shows content in a wrong pose
constexpr double kFalseDistance = 0.5,
                 kFalseRotationDeg = 30;  // beyond either: a false pose, of another place or side

struct RelocalizationFigures {
  // Share of the frames within distance and rotation.
  std::array<double, kRecallDistances.size()> recall{};
  std::array<double, kRecallDistances.size()> precision{};  // share of the answers
  double accepted = 0;                                      // answers per frame
  double false_share = 0;                                   // false poses per frame
  double median_position = 0, median_rotation_deg = 0;
};

RelocalizationFigures Summarize(const RelocalizationErrors& errors);

// The share of frames within a distance (and kRecallMaxRotationDeg).
double RecallAt(const RelocalizationErrors& errors, double distance);

// Time stamps of frames.csv (column "timestamp") or of a list "timestamp path". Throws InputError.
std::vector<double> LoadFrameTimes(const std::string& path);

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
