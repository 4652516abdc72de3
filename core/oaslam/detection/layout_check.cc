#include "oaslam/detection/layout_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

constexpr double kRounding = 0.01;  // of a network of 8 bits; half of it is its step

// Of all candidates of an output, also of those that are no objects.
std::string ProblemOfNumbers(const cv::Mat& output, const OutputFormat& format,
                             const cv::Size& network_size) {
  const Candidates candidates = CandidatesOf(output, format);
  const ScoreNumbers scores = ScoresOf(format);
  float least = 0, most = 0, farthest = 0;
  for (int i = 0; i < candidates.count; ++i) {
    farthest = std::max({farthest, std::abs(candidates(i, 0)), std::abs(candidates(i, 1))});
    for (int k = scores.first; k < scores.end; ++k) {
      least = std::min(least, candidates(i, k));
      most = std::max(most, candidates(i, k));
    }
  }
  // A list is filled up with rows of any negative score.
  if (most > 1 + kRounding || (!IsListed(format) && least < -kRounding))
    return fmt::format("a score of {:.4g}, allowed: 0 to 1", most > 1 + kRounding ? most : least);
  constexpr float kFinestStride = 8;  // pixels a cell
  const auto side = static_cast<float>(std::max(network_size.width, network_size.height));
  if (format.layout == DetectorLayout::kYolox && farthest * kFinestStride > 2 * side)
    return fmt::format("a centre {:.4g} cells from its own", farthest);
  return "";
}

bool IsPlausible(const Candidate& candidate, const OutputFormat& format,
                 const cv::Size& network_size) {
  constexpr double kMargin = 0.1;  // of the input, beyond which no centre is
  const Box& b = candidate.box;
  const auto is_near = [](double centre, double size) {
    return centre >= -kMargin * size && centre <= (1 + kMargin) * size;
  };
  return candidate.category_id >= 0 &&
         (format.classes == 0 || candidate.category_id < format.classes) && b.Width() >= 1 &&
         b.Height() >= 1 && is_near((b.x1 + b.x2) / 2, network_size.width) &&
         is_near((b.y1 + b.y2) / 2, network_size.height);
}

}  // namespace

std::string LayoutCheck::Add(const cv::Mat& output, const OutputFormat& format,
                             const cv::Size& network_size,
                             const std::vector<Candidate>& candidates) {
  constexpr int kFirst = 10;           // images
  constexpr double kLeastScore = 0.1;  // boxes with less are noise
  for (const Candidate& candidate : candidates)
    if (candidate.score > 1 + kRounding)
      return fmt::format("a score of {:.4g}, allowed: 0 to 1", candidate.score);
  if (images_ == kFirst) return "";
  if (std::string problem = ProblemOfNumbers(output, format, network_size); !problem.empty())
    return problem;
  const Candidate* example = nullptr;
  int seen = 0;
  for (const Candidate& candidate : candidates) {
    if (candidate.score < kLeastScore) continue;
    ++seen;
    if (IsPlausible(candidate, format, network_size)) {
      ++good_;
    } else {
      ++bad_;
      example = &candidate;
    }
  }
  images_ += seen > 0 ? 1 : 0;
  if (bad_ <= good_ || example == nullptr) return "";
  const Box& b = example->box;
  return fmt::format(
      "{} of {} boxes of the first images outside of them, smaller than a pixel or of no "
      "class, "
      "as [{:.4g}, {:.4g}, {:.4g}, {:.4g}] of class {} in an input of {}x{}",
      bad_, bad_ + good_, b.x1, b.y1, b.x2, b.y2, example->category_id, network_size.width,
      network_size.height);
}

}  // namespace oaslam
