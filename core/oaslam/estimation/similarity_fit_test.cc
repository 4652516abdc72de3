#include "oaslam/estimation/similarity_fit.h"

#include <gtest/gtest.h>

#include <vector>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

Similarity Truth() {
  return {2.5,
          Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized())),
          {3, -1, 0.5}};
}

Eigen::Vector3d Noise(double sigma, Rng& rng) {
  return {rng.Gaussian(sigma), rng.Gaussian(sigma), rng.Gaussian(sigma)};
}

// Cameras on a path of a metre in a; their poses in b are disturbed.
std::vector<PosePair> Pairs(int count, double sigma, double wrong, Rng& rng) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5 * i / count, Eigen::Vector3d::UnitY()));
    const Rigid3 a_from_cam(turn, Eigen::Vector3d(1.0 * i / count, 0.2 * std::sin(0.3 * i), 0.1));
    Rigid3 b_from_cam(Truth().rotation * turn,
                      Truth() * a_from_cam.translation + Noise(sigma, rng));
    const Eigen::Vector3d w = Noise(0.01, rng);
    b_from_cam.rotation =
        b_from_cam.rotation * Eigen::Quaterniond(Eigen::AngleAxisd(w.norm(), w.normalized()));
    if (rng.Uniform(0, 1) < wrong)
      b_from_cam =
          Rigid3(Eigen::Quaterniond(Eigen::AngleAxisd(2, Eigen::Vector3d::UnitX())), Noise(2, rng));
    pairs.push_back({a_from_cam.Inverse(), b_from_cam.Inverse(), sigma});
  }
  return pairs;
}

TEST(SimilarityFit, IsRightAmongWrongPoses) {
  Rng rng(3);
  const SimilarityFit fit = FitSimilarity(Pairs(60, 0.03, 0.3, rng));
  ASSERT_TRUE(fit.success);
  EXPECT_NEAR(fit.b_from_a.scale, Truth().scale, 0.03);
  EXPECT_LT(fit.b_from_a.rotation.angularDistance(Truth().rotation), 0.01);
  EXPECT_LT(
      (fit.b_from_a * Eigen::Vector3d(0.5, 0, 0.1) - Truth() * Eigen::Vector3d(0.5, 0, 0.1)).norm(),
      0.02);
  EXPECT_LT(fit.relative_sigma, 0.02);
  EXPECT_NEAR(fit.inliers, 42, 8);
}

TEST(SimilarityFit, KnowsThatAStillCameraSaysNothingAboutScale) {
  Rng rng(4);
  std::vector<PosePair> pairs = Pairs(60, 0.03, 0, rng);
  for (PosePair& pair : pairs) {
    pair.cam_from_a = pairs.front().cam_from_a;
    pair.cam_from_b = pairs.front().cam_from_b;
  }
  const SimilarityFit fit = FitSimilarity(pairs);
  EXPECT_TRUE(!fit.success || fit.relative_sigma > 0.1);
}

TEST(SimilarityFit, OnePoseIsEnoughWhereTheScaleIsKnown) {
  Rng rng(4);
  const std::vector<PosePair> pairs = Pairs(1, 0, 0, rng);
  const PosePair pair{pairs[0].cam_from_a, pairs[0].cam_from_b, 0.03};
  const SimilarityFit fit = FitSimilarity({&pair, 1}, ScalePrior{Truth().scale, 0.1});
  ASSERT_TRUE(fit.success);
  EXPECT_NEAR(fit.b_from_a.scale, Truth().scale, 1e-6);
  EXPECT_NEAR(fit.relative_sigma, 0.1, 1e-6);
  EXPECT_LT(
      (fit.b_from_a * pair.cam_from_a.OriginInSource() - pair.cam_from_b.OriginInSource()).norm(),
      1e-6);
}

TEST(SimilarityFit, PosesCorrectTheScaleThatIsExpected) {
  Rng rng(8);
  const SimilarityFit fit =
      FitSimilarity(Pairs(60, 0.03, 0.3, rng), ScalePrior{1.1 * Truth().scale, 0.1});
  ASSERT_TRUE(fit.success);
  EXPECT_NEAR(fit.b_from_a.scale, Truth().scale, 0.05);
}

TEST(SimilarityFit, RefusesToShrinkAWayToAPoint) {
  Rng rng(6);
  std::vector<PosePair> pairs = Pairs(12, 0.03, 0, rng);
  for (PosePair& pair : pairs)
    pair.cam_from_b.translation = -(pair.cam_from_b.rotation * Eigen::Vector3d(1, 2, 3));
  const SimilarityFit fit = FitSimilarity(pairs);
  EXPECT_TRUE(!fit.success || fit.relative_sigma > 0.1);
}

TEST(SimilarityFit, RefusesWhereMostDisagree) {
  Rng rng(5);
  EXPECT_FALSE(FitSimilarity(Pairs(40, 0.03, 0.8, rng)).success);
  EXPECT_FALSE(FitSimilarity(Pairs(2, 0.03, 0, rng)).success);
  EXPECT_FALSE(FitSimilarity({}).success);
}

TEST(SimilarityFit, OfAStillCameraHasTheScaleThatItsPointsTell) {
  Rng rng(8);
  std::vector<PosePair> pairs = Pairs(1, 0, 0, rng);
  pairs[0].sigma = 0.03;
  pairs[0].scale = {Truth().scale, 0.02};
  const SimilarityFit fit = FitSimilarity(pairs);
  ASSERT_TRUE(fit.success);
  EXPECT_NEAR(fit.b_from_a.scale, Truth().scale, 1e-6);
  EXPECT_NEAR(fit.relative_sigma, 0.02, 0.002);
}

TEST(SimilarityFit, IsNotMisledByAWrongScale) {
  Rng rng(9);
  std::vector<PosePair> pairs = Pairs(12, 0.3, 0, rng);
  for (PosePair& pair : pairs) pair.scale = {Truth().scale, 0.02};
  pairs[5].scale->scale *= 3;
  const SimilarityFit fit = FitSimilarity(pairs);
  ASSERT_TRUE(fit.success);
  EXPECT_NEAR(fit.b_from_a.scale, Truth().scale, 0.01 * Truth().scale);
  EXPECT_FALSE(fit.is_inlier[5]);
}

TEST(SimilarityFit, KnowsThatTwoScalesContradictEachOther) {
  Rng rng(10);
  std::vector<PosePair> pairs = Pairs(1, 0, 0, rng);
  pairs[0].sigma = 0.03;
  pairs.push_back(pairs[0]);
  pairs[0].scale = {Truth().scale, 0.02};
  pairs[1].scale = {2 * Truth().scale, 0.02};
  EXPECT_FALSE(FitSimilarity(pairs).success);
}

}  // namespace
}  // namespace oaslam
