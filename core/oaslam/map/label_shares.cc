#include "oaslam/map/label_shares.h"

#include <algorithm>
#include <cmath>

namespace oaslam {
namespace {

double ShareOf(const LabelsRef& labels, int category) {
  if (labels.shares.empty()) return category == labels.category_id ? 1 : 0;
  const auto found =
      std::ranges::lower_bound(labels.shares, category, {}, &LabelShare::category_id);
  return found != labels.shares.end() && found->category_id == category ? found->share : 0;
}

void Add(int category, double share, LabelShares& shares) {
  const auto place = std::ranges::lower_bound(shares, category, {}, &LabelShare::category_id);
  if (place != shares.end() && place->category_id == category)
    place->share += share;
  else
    shares.insert(place, {category, share});
}

}  // namespace

LabelShares SharesOf(const Detection& detection) {
  double sum = detection.score;
  for (const Label& label : detection.other_labels) sum += label.score;
  if (detection.other_labels.empty() || !(sum > 0)) return {};
  LabelShares shares;
  Add(detection.category_id, detection.score / sum, shares);
  for (const Label& label : detection.other_labels)
    Add(label.category_id, label.score / sum, shares);
  return shares;
}

bool AreConsistent(const LabelsRef& labels) {
  constexpr double kRounding = 1e-6;  // of sums over thousands of observations, in doubles
  double sum = 0;
  ForEachLabel(labels, [&](int, double share) { sum += share; });
  return std::abs(sum - 1) < kRounding && ShareOf(labels, labels.category_id) > 0;
}

double LabelNorm(const LabelsRef& labels) {
  double squares = 0;
  ForEachLabel(labels, [&](int, double share) { squares += share * share; });
  return std::sqrt(squares);
}

double LabelAgreement(const LabelsRef& a, const LabelsRef& b) {
  double product = 0;
  ForEachLabel(a, [&](int category, double share) { product += share * ShareOf(b, category); });
  return product / (LabelNorm(a) * LabelNorm(b));
}

LabelShares MeanShares(const LabelsRef& a, double weight_a, const LabelsRef& b, double weight_b) {
  if (a.shares.empty() && b.shares.empty() && a.category_id == b.category_id) return {};
  const double sum = weight_a + weight_b;
  LabelShares mean;
  ForEachLabel(a, [&](int category, double share) { Add(category, share * weight_a / sum, mean); });
  ForEachLabel(b, [&](int category, double share) { Add(category, share * weight_b / sum, mean); });
  return mean;
}

int CommonestLabel(const LabelsRef& labels) {
  LabelShare best{labels.category_id, ShareOf(labels, labels.category_id)};
  for (const LabelShare& label : labels.shares)
    if (label.share > best.share) best = label;
  return best.category_id;
}

}  // namespace oaslam
