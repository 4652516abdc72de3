#include "oaslam/features/hamming_search.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/features/hamming_search.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// The first descriptors, as many as fill whole vectors; returns how many these are.
#if HWY_TARGET == HWY_SCALAR
size_t FindCloseInVectors(const Descriptor&, const DescriptorColumns&, int,
                          std::vector<CloseDescriptor>&) {
  return 0;
}
#else
size_t FindCloseInVectors(const Descriptor& descriptor, const DescriptorColumns& among,
                          int max_distance, std::vector<CloseDescriptor>& close) {
  const hn::ScalableTag<uint64_t> d;
  const hn::Repartition<uint8_t, decltype(d)> d_bytes;
  const hn::RebindToSigned<decltype(d)> d_signed;
  const size_t lanes = hn::Lanes(d), end = among.size() - among.size() % lanes;
  const auto first = hn::Iota(d, 0);
  const auto bits = [&](size_t word, size_t i) {  // in each byte
    const auto seen = hn::LoadU(d, among.words[word].data() + i);
    return hn::PopulationCount(hn::BitCast(d_bytes, hn::Xor(hn::Set(d, descriptor[word]), seen)));
  };
  constexpr size_t kBlock = 512;
  HWY_ALIGN uint64_t found[kBlock + hn::MaxLanes(d)];  // the distance, then the index
  for (size_t begin = 0; begin < end; begin += kBlock) {
    size_t count = 0;
    for (size_t i = begin; i < std::min(begin + kBlock, end); i += lanes) {
      const auto distance =
          hn::SumsOf8(hn::Add(hn::Add(bits(0, i), bits(1, i)), hn::Add(bits(2, i), bits(3, i))));
      const auto is_close = hn::MaskFromVec(
          hn::BitCast(d, hn::VecFromMask(d_signed, hn::Lt(hn::BitCast(d_signed, distance),
                                                          hn::Set(d_signed, max_distance + 1)))));
      count +=
          hn::CompressStore(hn::Add(hn::ShiftLeft<32>(distance), hn::Add(first, hn::Set(d, i))),
                            is_close, d, found + count);
    }
    for (size_t n = 0; n < count; ++n)
      close.push_back({static_cast<int>(found[n] & 0xffffffff), static_cast<int>(found[n] >> 32)});
  }
  return end;
}
#endif

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {
namespace {

HWY_EXPORT(FindCloseInVectors);

}  // namespace

void FindClose(const Descriptor& descriptor, const DescriptorColumns& among, int max_distance,
               std::vector<CloseDescriptor>& close) {
  close.clear();
  size_t i = HWY_DYNAMIC_DISPATCH(FindCloseInVectors)(descriptor, among, max_distance, close);
  for (; i < among.size(); ++i) {
    const auto& w = among.words;
    const int distance = HammingDistance(descriptor, {w[0][i], w[1][i], w[2][i], w[3][i]});
    if (distance <= max_distance) close.push_back({static_cast<int>(i), distance});
  }
}

}  // namespace oaslam

#endif  // HWY_ONCE
