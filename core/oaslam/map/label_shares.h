#pragma once

#include <vector>

#include "oaslam/types.h"

namespace oaslam {

// How often an object is given a label.
struct LabelShare {
  int category_id = 0;
  double share = 0;
  bool operator==(const LabelShare&) const = default;
};

// The labels that a detector gives to a detection, or to an object over many detections: ascending
// by class, with shares that sum to 1. Empty where the detector gives one label only, which is the
// category of the owner.
using LabelShares = std::vector<LabelShare>;

// The labels of a detection or object. Refers to its owner.
struct LabelsRef {
  int category_id;
  const LabelShares& shares;
};

template <typename T>
LabelsRef LabelsOf(const T& owner) {
  return {owner.category_id, owner.shares};
}
template <typename T>
LabelsRef LabelsOf(const T&& owner) = delete;

// Calls visit(class, share) for each label.
template <typename Visitor>
void ForEachLabel(const LabelsRef& labels, Visitor&& visit) {
  if (labels.shares.empty()) visit(labels.category_id, 1.0);
  for (const LabelShare& label : labels.shares) visit(label.category_id, label.share);
}

// The scores of a detection's labels, divided by their sum.
LabelShares SharesOf(const Detection& detection);

// Whether the shares are as they should be: they sum to 1, and that of the category is above 0.
bool AreConsistent(const LabelsRef& labels);

// The square root of the sum of the squared shares; 1 where there is one label.
double LabelNorm(const LabelsRef& labels);

// How well the labels of two things agree, in [0, 1]: the cosine of the angle between their shares
// as vectors. 1 where these are equal, 0 where no class is in both. It stands for the likelihood
// that two detections or objects with these labels are the same.
double LabelAgreement(const LabelsRef& a, const LabelsRef& b);

// Two detections or objects whose labels agree less than this are not the same. The bound is small,
// since it only excludes: with a share of 5 % of a second label, two objects are compared, and
// their positions decide.
constexpr double kLeastAgreement = 0.05;

inline bool MayBeTheSame(const LabelsRef& a, const LabelsRef& b) {
  return LabelAgreement(a, b) >= kLeastAgreement;
}

// The mean of the shares of two things with these weights; empty where both have the same single
// label.
LabelShares MeanShares(const LabelsRef& a, double weight_a, const LabelsRef& b, double weight_b);

// The class with the largest share; the category itself where that is as large.
int CommonestLabel(const LabelsRef& labels);

}  // namespace oaslam
