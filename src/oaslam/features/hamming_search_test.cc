#include "oaslam/features/hamming_search.h"

#include <gtest/gtest.h>

#include "instruction_sets.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

class HammingSearch : public EveryInstructionSet {};

TEST_P(HammingSearch, FindsWhatIsCloseInItsOrder) {
  Rng rng(3);
  const auto random_word = [&] {
    uint64_t word = 0;
    for (int b = 0; b < 64; ++b) word = word << 1 | static_cast<uint64_t>(rng.Index(2));
    return word;
  };
  const Descriptor query{random_word(), random_word(), random_word(), ~uint64_t{0}};
  for (const int size : {0, 1, 7, 61, 512, 1100}) {
    DescriptorColumns among;
    std::vector<CloseDescriptor> expected;
    for (int i = 0; i < size; ++i) {
      Descriptor d = query;
      for (int flipped = static_cast<int>(rng.Index(80)); flipped > 0; --flipped) {
        const int bit = rng.Index(256);
        d[bit / 64] ^= uint64_t{1} << (bit % 64);
      }
      among.Add(d);
      if (const int distance = HammingDistance(query, d); distance <= 30)
        expected.push_back({i, distance});
    }
    EXPECT_GE(expected.size(), size > 60 ? 5U : 0U);
    std::vector<CloseDescriptor> close{{5, 5}};
    FindClose(query, among, 30, close);
    EXPECT_EQ(close, expected);
  }
}

INSTANTIATE_TEST_SUITE_P(Kernels, HammingSearch, testing::ValuesIn(InstructionSets()),
                         NameOfInstructionSet);

}  // namespace
}  // namespace oaslam
