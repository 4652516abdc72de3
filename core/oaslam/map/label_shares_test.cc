#include "oaslam/map/label_shares.h"

#include <gtest/gtest.h>

#include <cmath>

namespace oaslam {
namespace {

LabelShares Shares(const std::vector<Label>& labels) {
  Detection detection;
  detection.category_id = labels.at(0).category_id;
  detection.score = labels.at(0).score;
  detection.other_labels.assign(labels.begin() + 1, labels.end());
  return SharesOf(detection);
}

TEST(LabelShares, OneLabelAgreesWithItselfAlone) {
  const LabelShares none;
  EXPECT_TRUE(Shares({{41, 0.3}}).empty());
  EXPECT_EQ(LabelAgreement({41, none}, {41, none}), 1);
  EXPECT_EQ(LabelAgreement({41, none}, {45, none}), 0);
  EXPECT_FALSE(MayBeTheSame({41, none}, {45, none}));
  EXPECT_TRUE(MeanShares({41, none}, 5, {41, none}, 1).empty());
  EXPECT_EQ(CommonestLabel({41, none}), 41);
}

TEST(LabelShares, SeveralLabelsAgreeInPart) {
  const LabelShares none, cup = Shares({{45, 0.2}, {41, 0.6}}),
                          bowl = Shares({{45, 0.9}, {41, 0.1}});
  ASSERT_EQ(cup.size(), 2u);
  EXPECT_EQ(cup[0].category_id, 41);
  EXPECT_DOUBLE_EQ(cup[0].share, 0.75);
  EXPECT_DOUBLE_EQ(cup[1].share, 0.25);
  const double norm = std::sqrt(0.75 * 0.75 + 0.25 * 0.25);
  EXPECT_DOUBLE_EQ(LabelNorm({41, cup}), norm);
  EXPECT_DOUBLE_EQ(LabelAgreement({41, cup}, {41, cup}), 1);
  EXPECT_DOUBLE_EQ(LabelAgreement({41, cup}, {41, none}), 0.75 / norm);
  EXPECT_DOUBLE_EQ(LabelAgreement({45, none}, {41, cup}), 0.25 / norm);
  EXPECT_DOUBLE_EQ(LabelAgreement({41, cup}, {45, bowl}),
                   (0.75 * 0.1 + 0.25 * 0.9) / norm / std::sqrt(0.9 * 0.9 + 0.1 * 0.1));
  EXPECT_TRUE(MayBeTheSame({45, none}, {41, cup}));
  EXPECT_FALSE(MayBeTheSame({60, none}, {41, cup}));
}

TEST(LabelShares, SumToOneAndHaveTheCategory) {
  const LabelShares none, right{{41, 0.75}, {45, 0.25}}, zero{{41, 0}, {45, 0}}, few{{41, 0.5}};
  EXPECT_TRUE(AreConsistent({41, none}));
  EXPECT_TRUE(AreConsistent({41, right}));
  EXPECT_FALSE(AreConsistent({60, right}));
  EXPECT_FALSE(AreConsistent({41, zero}));
  EXPECT_FALSE(AreConsistent({41, few}));
}

TEST(LabelShares, TheMeanIsWeighted) {
  const LabelShares none;
  const LabelShares mean = MeanShares({41, none}, 3, {45, none}, 1);
  EXPECT_EQ(mean, (LabelShares{{41, 0.75}, {45, 0.25}}));
  EXPECT_EQ(CommonestLabel({45, mean}), 41);
  // A new class stands in its place in the order.
  EXPECT_EQ(MeanShares({41, mean}, 1, {43, none}, 1),
            (LabelShares{{41, 0.375}, {43, 0.5}, {45, 0.125}}));
  // A tie changes nothing.
  EXPECT_EQ(CommonestLabel({45, MeanShares({41, none}, 1, {45, none}, 1)}), 45);
}

}  // namespace
}  // namespace oaslam
