#include "oaslam/evaluation/reliability.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"

namespace oaslam {

std::vector<HypothesisError> CompareHypotheses(
    const std::vector<StampedPose>& groundtruth, const std::vector<ScoredPose>& hypotheses,
    const std::vector<std::pair<double, double>>& confidences,
    const Alignment& groundtruth_from_map) {
  std::vector<StampedPose> best;
  for (const ScoredPose& hypothesis : hypotheses)
    if (best.empty() || best.back().timestamp != hypothesis.pose.timestamp)
      best.push_back(hypothesis.pose);
  const auto truth = WithoutDuplicates(groundtruth);
  std::vector<HypothesisError> errors;
  for (const auto& [reference, query] : Associate(truth, best)) {
    const auto frame = std::ranges::lower_bound(confidences, best[query].timestamp - 1e-6, {},
                                                &std::pair<double, double>::first);
    if (frame == confidences.end() || frame->first > best[query].timestamp + 1e-6) continue;
    errors.push_back({frame->second, ErrorOf(truth[reference], best[query], groundtruth_from_map)});
  }
  return errors;
}

Reliability SummarizeReliability(std::span<const HypothesisError> hypotheses) {
  Reliability result;
  result.count = hypotheses.size();
  for (const HypothesisError& h : hypotheses) {
    const double right =
        h.error.position <= kFalseDistance && h.error.rotation_deg <= kFalseRotationDeg ? 1 : 0;
    const auto index =
        std::min(static_cast<size_t>(h.confidence * static_cast<double>(result.bins.size())),
                 result.bins.size() - 1);
    ReliabilityBin& bin = result.bins[index];
    ++bin.count;
    bin.mean_confidence += h.confidence;
    bin.share_right += right;
    result.brier += (h.confidence - right) * (h.confidence - right);
  }
  for (ReliabilityBin& bin : result.bins) {
    if (bin.count == 0) continue;
    result.calibration_error += std::abs(bin.mean_confidence - bin.share_right);
    bin.mean_confidence /= static_cast<double>(bin.count);
    bin.share_right /= static_cast<double>(bin.count);
  }
  if (result.count > 0) {
    result.brier /= static_cast<double>(result.count);
    result.calibration_error /= static_cast<double>(result.count);
  }
  return result;
}

void SaveHypothesisErrors(const std::string& path, std::span<const HypothesisError> hypotheses) {
  std::string text = "timestamp,confidence,position_error_m,rotation_error_deg\n";
  for (const HypothesisError& h : hypotheses)
    text += fmt::format("{:.6f},{:.4f},{:.6g},{:.4f}\n", h.error.timestamp, h.confidence,
                        h.error.position, h.error.rotation_deg);
  WriteTextFile(path, text);
}

std::vector<HypothesisError> LoadHypothesisErrors(const std::string& path) {
  std::vector<HypothesisError> hypotheses;
  for (const auto& row :
       LoadColumns(path, {"timestamp", "confidence", "position_error_m", "rotation_error_deg"})) {
    if (!(row[1] >= 0 && row[1] <= 1))
      throw InputError(fmt::format("{}: confidence {}, allowed: 0 to 1", path, row[1]));
    hypotheses.push_back({row[1], {row[0], row[2], row[3]}});
  }
  return hypotheses;
}

}  // namespace oaslam
