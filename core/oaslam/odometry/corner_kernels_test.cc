#include "oaslam/odometry/corner_kernels.h"

#include <gtest/gtest.h>

#include "instruction_sets.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

using CornerKernels = EveryInstructionSet;

TEST_P(CornerKernels, GiveTheSameBitsAsTheOldestInstructionSet) {
  constexpr int kWidth = 97, kHeight = 61;
  Rng rng(1);
  std::vector<uint8_t> pixels(kWidth * kHeight);
  for (uint8_t& pixel : pixels) pixel = static_cast<uint8_t>(rng.Index(256));
  const GreyImage image{pixels.data(), kWidth, kWidth, kHeight};
  constexpr int kEdge = kCornerBlock + 1;
  CornerScratch scratch;
  std::vector<float> strengths, expected;
  CornerStrengths(image, {kEdge, kEdge, kWidth - kEdge, kHeight - kEdge}, scratch, strengths);
  Use(0);  // else only the set of this test is listed
  Use(InstructionSets().back());
  CornerStrengths(image, {kEdge, kEdge, kWidth - kEdge, kHeight - kEdge}, scratch, expected);
  EXPECT_EQ(strengths, expected);
}

INSTANTIATE_TEST_SUITE_P(All, CornerKernels, testing::ValuesIn(InstructionSets()),
                         NameOfInstructionSet);

}  // namespace
}  // namespace oaslam
