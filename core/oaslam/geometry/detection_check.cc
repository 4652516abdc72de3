#include "oaslam/geometry/detection_check.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

namespace oaslam {
namespace {

constexpr double kMaxCoordinate = 1e5;  // pixels; beyond any image

bool IsCoordinate(double value) { return std::abs(value) <= kMaxCoordinate; }  // false for NaN

}  // namespace

std::string ProblemOfCategory(int64_t category_id) {
  if (category_id >= 0 && category_id <= kMaxCategory) return "";
  return fmt::format("{}, expected a whole number from 0 to {}", category_id, kMaxCategory);
}

std::string ProblemOfScore(double score) {
  constexpr double kRounding = 1e-6;  // rounding error of a detector that computes with 32 bits
  if (score >= 0 && score <= 1 + kRounding) return "";
  return fmt::format("{}, allowed: 0 to 1", score);
}

std::string ProblemOfLabels(std::span<const Label> labels) {
  std::set<int> listed;
  for (const Label& label : labels) {
    if (auto problem = ProblemOfCategory(label.category_id); !problem.empty()) return problem;
    if (auto problem = ProblemOfScore(label.score); !problem.empty()) return problem;
    if (!listed.insert(label.category_id).second)
      return fmt::format("class {} is listed twice", label.category_id);
  }
  return "";
}

std::string ProblemOfBox(const Box& box) {
  const std::array edges{box.x1, box.y1, box.x2, box.y2};
  const std::string shown = fmt::format("[{}]", fmt::join(edges, ", "));
  if (!std::ranges::all_of(edges, IsCoordinate))
    return fmt::format("{}, allowed: -{:.0f} to {:.0f}", shown, kMaxCoordinate, kMaxCoordinate);
  if (!(box.x2 > box.x1 && box.y2 > box.y1))
    return shown + " as corners, expected x1 < x2 and y1 < y2";
  return "";
}

std::string ProblemOfEllipse(const std::array<double, 5>& ellipse) {
  const std::string shown = fmt::format("[{}]", fmt::join(ellipse, ", "));
  if (!std::ranges::all_of(ellipse, IsCoordinate))
    return fmt::format("{}, allowed: -{:.0f} to {:.0f}", shown, kMaxCoordinate, kMaxCoordinate);
  if (!(ellipse[2] > 0 && ellipse[3] > 0)) return shown + ", width and height must be above 0";
  return "";
}

std::string ProblemOf(const Detection& detection) {
  if (const auto problem = ProblemOfCategory(detection.category_id); !problem.empty())
    return "category_id: " + problem;
  if (const auto problem = ProblemOfScore(detection.score); !problem.empty())
    return "score: " + problem;
  if (const auto problem = ProblemOfBox(detection.box); !problem.empty()) return "box: " + problem;
  std::vector<Label> labels = detection.other_labels;
  labels.push_back({detection.category_id, detection.score});
  if (const auto problem = ProblemOfLabels(labels); !problem.empty())
    return "other_labels: " + problem;
  for (const Label& label : detection.other_labels)
    if (label.score > detection.score)
      return fmt::format("other_labels: class {} has the score {}, above that of the detection, {}",
                         label.category_id, label.score, detection.score);
  if (!detection.ellipse) return "";
  const std::string problem = ProblemOfEllipse(*detection.ellipse);
  return problem.empty() ? "" : "ellipse: " + problem;
}

}  // namespace oaslam
