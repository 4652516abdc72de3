#include "oaslam/features/hamming_search.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "instruction_sets.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

class HammingSearch : public EveryInstructionSet {};

Descriptor WithBitsFlipped(Descriptor descriptor, int count, Rng& rng) {
  for (; count > 0; --count) {
    const int bit = rng.Index(256);
    descriptor[bit / 64] ^= uint64_t{1} << (bit % 64);
  }
  return descriptor;
}

TEST_P(HammingSearch, ComparesSeveralWithAll) {
  Rng rng(3);
  std::vector<Descriptor> descriptors(3);
  for (Descriptor& d : descriptors) d = WithBitsFlipped(d, 500, rng);
  for (const int size : {0, 1, 7, 63, 64, 65, 300}) {
    DescriptorColumns among;
    std::array<std::vector<uint8_t>, 3> expected;
    for (int i = 0; i < size; ++i) {
      const Descriptor d = WithBitsFlipped(descriptors[i % 3], rng.Index(80), rng);
      among.Add(d);
      for (size_t r = 0; r < 3; ++r)
        expected[r].push_back(static_cast<uint8_t>(HammingDistance(descriptors[r], d)));
    }
    std::array<DistanceRow, kComparedTogether> rows;
    CompareWithAll(descriptors, among, rows);
    for (size_t r = 0; r < 3; ++r) {
      EXPECT_EQ(rows[r].hamming, expected[r]);
      EXPECT_EQ(rows[r].smallest, size ? std::ranges::min(expected[r]) : 255);
    }
  }
}

TEST_P(HammingSearch, AllBitsDiffering) {
  const Descriptor descriptor{1, 2, 3, 4};
  DescriptorColumns among;
  among.Add({~descriptor[0], ~descriptor[1], ~descriptor[2], ~descriptor[3]});
  std::array<DistanceRow, kComparedTogether> rows;
  CompareWithAll({&descriptor, 1}, among, rows);
  EXPECT_EQ(rows[0].hamming, std::vector<uint8_t>{255});
}

TEST_P(HammingSearch, FindsWhatIsBelowEitherBound) {
  Rng rng(4);
  for (const int size : {0, 1, 63, 64, 65, 300}) {
    DistanceRow row;
    std::vector<uint8_t> bounds;
    std::vector<int> expected;
    for (int i = 0; i < size; ++i) {
      row.hamming.push_back(static_cast<uint8_t>(rng.Index(256)));
      bounds.push_back(static_cast<uint8_t>(rng.Index(60)));
      if (row.hamming[i] < 30 || row.hamming[i] < bounds[i]) expected.push_back(i);
    }
    std::vector<int> found{5};
    FindBelow(row, bounds, 30, found);
    EXPECT_EQ(found, expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, HammingSearch, testing::ValuesIn(InstructionSets()),
                         NameOfInstructionSet);

}  // namespace
}  // namespace oaslam
