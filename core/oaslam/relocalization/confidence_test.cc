#include "oaslam/relocalization/confidence.h"

#include <gtest/gtest.h>

namespace oaslam {
namespace {

double Confidence(double score, double margin, size_t matched) {
  ObjectSupport best;
  best.score = score;
  best.margin = margin;
  best.matched.resize(matched);
  return ConfidenceOfObjects(best);
}

TEST(Confidence, GrowsWithTheScoreAndWithTheMargin) {
  EXPECT_GT(Confidence(40, 10, 5), Confidence(35, 10, 5));
  EXPECT_GT(Confidence(40, 15, 5), Confidence(40, 10, 5));
  EXPECT_GT(Confidence(100, 100, 8), 0.999);
  EXPECT_LT(Confidence(10, 0, 3), 0.1);
}

// Eight objects that fit badly are weaker evidence than four that fit well.
TEST(Confidence, IsLessWhereMoreObjectsMakeUpTheSameScore) {
  EXPECT_LT(Confidence(38, 18, 8), 0.6);
  EXPECT_GT(Confidence(38, 18, 4), 0.9);
}

TEST(Confidence, OfObjectsAloneIsLowInARoomThatIsArrangedAlike) {
  const auto alone = [](double score, double margin, size_t matched, double relative_sigma) {
    ObjectSupport best;
    best.score = score;
    best.margin = margin;
    best.matched.resize(matched);
    best.relative_sigma = relative_sigma;
    return ConfidenceOfObjectsAlone(best);
  };
  EXPECT_GT(alone(50, 50, 5, 0.04), 0.95);
  EXPECT_GT(alone(142, 142, 15, 0.02), 0.99);
  EXPECT_LT(alone(66, 66, 10, 0.02), 0.9);  // fits less well, but nowhere else
  EXPECT_LT(alone(75, 22, 9, 0.02), 0.9);   // fits nearly as well elsewhere
  EXPECT_LT(alone(44, 44, 4, 0.2), 0.9);    // fits well, from too far away
  EXPECT_LE(alone(38, 18, 4, 0.01), Confidence(38, 18, 4));
  EXPECT_EQ(alone(0, 0, 0, 1), 0);
}

TEST(Confidence, OfBothIsWrongOnlyWhereBothAreWrong) {
  EXPECT_DOUBLE_EQ(ConfidenceOfBoth(0.5, 0.8), 0.9);
  EXPECT_DOUBLE_EQ(ConfidenceOfBoth(1, 0), 1);
  EXPECT_DOUBLE_EQ(ConfidenceOfBoth(0, 0), 0);
}

}  // namespace
}  // namespace oaslam
