#include "oaslam/evaluation/reliability.h"

#include <fmt/format.h>

#include <algorithm>

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

void SaveHypothesisErrors(const std::string& path, std::span<const HypothesisError> hypotheses) {
  std::string text = "timestamp,confidence,position_error_m,rotation_error_deg\n";
  for (const HypothesisError& h : hypotheses)
    text += fmt::format("{:.6f},{:.4f},{:.6g},{:.4f}\n", h.error.timestamp, h.confidence,
                        h.error.position, h.error.rotation_deg);
  WriteTextFile(path, text);
}

}  // namespace oaslam
