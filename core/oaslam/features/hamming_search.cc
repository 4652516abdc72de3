#include "oaslam/features/hamming_search.h"

#include <algorithm>
#include <bit>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/features/hamming_search.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Bytes = hn::CappedTag<uint8_t, DescriptorColumns::kBlock>;

// For one half byte of each descriptor that is compared: how many of its bits differ from each of
// the 16 that another can have there.
using DifferingBits = std::array<const uint8_t*, kComparedTogether>;

// Writes the distances of `kComparedTogether` descriptors to all in the blocks, and the smallest of
// each (255 if there are none). `differing`: one for each half byte.
#if HWY_TARGET == HWY_SCALAR
void CompareWithBlocks(const DifferingBits* differing, std::span<const uint8_t> half_bytes,
                       uint8_t* const* rows, uint8_t* smallest) {
  constexpr size_t kBlock = DescriptorColumns::kBlock;
  std::fill(smallest, smallest + kComparedTogether, uint8_t{255});
  for (size_t r = 0; r < kComparedTogether; ++r)
    for (size_t i = 0; i < half_bytes.size() / DescriptorColumns::kHalfBytes; ++i) {
      const uint8_t* block = &half_bytes[i / kBlock * kBlock * DescriptorColumns::kHalfBytes];
      int distance = 0;
      for (size_t h = 0; h < DescriptorColumns::kHalfBytes; ++h)
        distance += differing[h][r][block[h * kBlock + i % kBlock]];
      rows[r][i] = static_cast<uint8_t>(std::min(distance, 255));
      smallest[r] = std::min(smallest[r], rows[r][i]);
    }
}
#else
void CompareWithBlocks(const DifferingBits* differing, std::span<const uint8_t> half_bytes,
                       uint8_t* const* rows, uint8_t* smallest) {
  static_assert(kComparedTogether == 4);
  const Bytes d;
  const size_t lanes = hn::Lanes(d);
  const auto differ = [d](const uint8_t* bits, hn::Vec<Bytes> seen)
                          HWY_ATTR { return hn::TableLookupBytes(hn::LoadDup128(d, bits), seen); };
  auto least_0 = hn::Set(d, 255), least_1 = least_0, least_2 = least_0, least_3 = least_0;
  size_t row = 0;
  for (size_t begin = 0; begin < half_bytes.size();
       begin += DescriptorColumns::kBlock * DescriptorColumns::kHalfBytes)
    for (size_t i = 0; i < DescriptorColumns::kBlock; i += lanes, row += lanes) {
      auto sum_0 = hn::Zero(d), sum_1 = sum_0, sum_2 = sum_0, sum_3 = sum_0;
      for (size_t h = 0; h < DescriptorColumns::kHalfBytes; ++h) {
        const auto seen =
            hn::LoadU(d, half_bytes.data() + begin + h * DescriptorColumns::kBlock + i);
        sum_0 = hn::SaturatedAdd(sum_0, differ(differing[h][0], seen));
        sum_1 = hn::SaturatedAdd(sum_1, differ(differing[h][1], seen));
        sum_2 = hn::SaturatedAdd(sum_2, differ(differing[h][2], seen));
        sum_3 = hn::SaturatedAdd(sum_3, differ(differing[h][3], seen));
      }
      hn::StoreU(sum_0, d, rows[0] + row);
      hn::StoreU(sum_1, d, rows[1] + row);
      hn::StoreU(sum_2, d, rows[2] + row);
      hn::StoreU(sum_3, d, rows[3] + row);
      least_0 = hn::Min(least_0, sum_0);
      least_1 = hn::Min(least_1, sum_1);
      least_2 = hn::Min(least_2, sum_2);
      least_3 = hn::Min(least_3, sum_3);
    }
  HWY_ALIGN uint8_t least[DescriptorColumns::kBlock];
  const auto least_of = [&](hn::Vec<Bytes> each) HWY_ATTR {
    hn::Store(each, d, least);
    return *std::min_element(least, least + lanes);
  };
  smallest[0] = least_of(least_0);
  smallest[1] = least_of(least_1);
  smallest[2] = least_of(least_2);
  smallest[3] = least_of(least_3);
}
#endif

void CollectBelow(const uint8_t* distances, const uint8_t* bounds, uint8_t bound, size_t count,
                  std::vector<int>& found) {
  const Bytes d;
  const size_t lanes = hn::Lanes(d);
  const auto bound_of_all = hn::Set(d, bound);
  size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto below =
        hn::Lt(hn::LoadU(d, distances + i), hn::Max(bound_of_all, hn::LoadU(d, bounds + i)));
    if (hn::AllFalse(d, below)) continue;
    uint64_t bits = 0;
    hn::StoreMaskBits(d, below, reinterpret_cast<uint8_t*>(&bits));
    for (; bits; bits &= bits - 1) found.push_back(static_cast<int>(i) + std::countr_zero(bits));
  }
  for (; i < count; ++i)
    if (distances[i] < std::max(bound, bounds[i])) found.push_back(static_cast<int>(i));
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {
namespace {

HWY_EXPORT(CompareWithBlocks);
HWY_EXPORT(CollectBelow);

constexpr std::array<std::array<uint8_t, 16>, 16> BitsThatDiffer() {
  std::array<std::array<uint8_t, 16>, 16> table{};
  for (unsigned a = 0; a < 16; ++a)
    for (unsigned b = 0; b < 16; ++b) table[a][b] = static_cast<uint8_t>(std::popcount(a ^ b));
  return table;
}

constexpr std::array<std::array<uint8_t, 16>, 16> kBitsThatDiffer = BitsThatDiffer();

uint8_t HalfByte(const Descriptor& descriptor, size_t h) {
  return descriptor[h / 16] >> (4 * (h % 16)) & 15;
}

}  // namespace

void DescriptorColumns::Add(const Descriptor& descriptor) {
  const size_t in_block = size_ % kBlock;
  if (in_block == 0) half_bytes_.resize(half_bytes_.size() + kBlock * kHalfBytes);
  uint8_t* block = half_bytes_.data() + half_bytes_.size() - kBlock * kHalfBytes;
  for (size_t h = 0; h < kHalfBytes; ++h, block += kBlock)
    if (in_block == 0)
      std::memset(block, HalfByte(descriptor, h), kBlock);
    else
      block[in_block] = HalfByte(descriptor, h);
  ++size_;
}

void CompareWithAll(std::span<const Descriptor> descriptors, const DescriptorColumns& among,
                    std::array<DistanceRow, kComparedTogether>& rows) {
  std::array<std::array<const uint8_t*, kComparedTogether>, DescriptorColumns::kHalfBytes>
      differing;
  for (size_t h = 0; h < differing.size(); ++h)
    for (size_t r = 0; r < kComparedTogether; ++r)
      differing[h][r] =
          kBitsThatDiffer[HalfByte(descriptors[std::min(r, descriptors.size() - 1)], h)].data();
  std::array<uint8_t*, kComparedTogether> distances;
  std::array<uint8_t, kComparedTogether> smallest;
  for (size_t r = 0; r < kComparedTogether; ++r) {
    rows[r].hamming.resize(among.half_bytes().size() / DescriptorColumns::kHalfBytes);
    distances[r] = rows[r].hamming.data();
  }
  HWY_DYNAMIC_DISPATCH(CompareWithBlocks)
  (differing.data(), among.half_bytes(), distances.data(), smallest.data());
  for (size_t r = 0; r < kComparedTogether; ++r) {
    rows[r].hamming.resize(among.size());
    rows[r].smallest = smallest[r];
  }
}

void FindBelow(const DistanceRow& row, const std::vector<uint8_t>& bounds, uint8_t bound,
               std::vector<int>& found) {
  found.clear();
  HWY_DYNAMIC_DISPATCH(CollectBelow)
  (row.hamming.data(), bounds.data(), bound, row.hamming.size(), found);
}

}  // namespace oaslam

#endif  // HWY_ONCE
