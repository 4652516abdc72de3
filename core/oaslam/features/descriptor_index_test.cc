#include "oaslam/features/descriptor_index.h"

#include <gtest/gtest.h>

#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

Descriptor RandomDescriptor(Rng& rng) { return {rng.Next(), rng.Next(), rng.Next(), rng.Next()}; }

Descriptor WithFlips(Descriptor d, int flips, Rng& rng) {
  for (int i = 0; i < flips; ++i) {
    const int bit = rng.Index(256);
    d[bit / 64] ^= uint64_t{1} << (bit % 64);
  }
  return d;
}

TEST(DescriptorIndex, FindsMostNeighbours) {
  Rng rng(1);
  std::vector<Descriptor> descriptors;
  std::vector<uint32_t> labels;
  for (uint32_t i = 0; i < 20000; ++i) {
    descriptors.push_back(RandomDescriptor(rng));
    labels.push_back(i);
  }
  const DescriptorIndex index(descriptors, labels);
  int found_near = 0, found_far = 0;
  for (uint32_t i = 0; i < 500; ++i) {
    const auto near = index.Query(WithFlips(descriptors[i], 25, rng), 64, 8);
    found_near += !near.empty() && near.front().label == i;
    const auto far = index.Query(WithFlips(descriptors[i], 45, rng), 64, 8);
    found_far += !far.empty() && far.front().label == i;
    EXPECT_TRUE(index.Query(RandomDescriptor(rng), 64, 8).empty());
  }
  EXPECT_GT(found_near, 480);
  EXPECT_GT(found_far, 350);
}

TEST(DescriptorIndex, EachLabelOnceNearestFirst) {
  Rng rng(2);
  const Descriptor d = RandomDescriptor(rng);
  const DescriptorIndex index({WithFlips(d, 5, rng), d, WithFlips(d, 9, rng), d}, {7, 7, 3, 4});
  const auto hits = index.Query(d, 64, 8);
  ASSERT_EQ(hits.size(), 3U);
  EXPECT_EQ(hits[0], (DescriptorIndex::Hit{4, 0}));
  EXPECT_EQ(hits[1], (DescriptorIndex::Hit{7, 0}));
  EXPECT_EQ(hits[2].label, 3U);
  EXPECT_EQ(index.Query(d, 64, 1).size(), 1U);
}

TEST(DescriptorIndex, EmptyFindsNothing) {
  EXPECT_TRUE(DescriptorIndex().Query(Descriptor{}, 256, 8).empty());
  EXPECT_TRUE(DescriptorIndex({}, {}).Query(Descriptor{}, 256, 8).empty());
}

}  // namespace
}  // namespace oaslam
