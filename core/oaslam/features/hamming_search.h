#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "oaslam/features/features.h"

namespace oaslam {

// Descriptors stored by half bytes, so that vector instructions compare many of them at a time:
// they look up the number of differing bits of a half byte in a table, which is fast also on a
// processor without vectorised popcount.
class DescriptorColumns {
 public:
  static constexpr size_t kBlock = 64;      // descriptors
  static constexpr size_t kHalfBytes = 64;  // of a descriptor

  size_t size() const { return size_; }
  void Add(const Descriptor& descriptor);

  // [block][half byte][descriptor of the block]; the last block is filled up with its first one.
  const std::vector<uint8_t>& half_bytes() const { return half_bytes_; }

 private:
  size_t size_ = 0;
  std::vector<uint8_t> half_bytes_;
};

// How far one descriptor is from each of many.
struct DistanceRow {
  std::vector<uint8_t> hamming;  // 255 also for 256
  uint8_t smallest = 255;
};

// As many descriptors as are compared together.
constexpr size_t kComparedTogether = 4;

// Compares each of 1 to `kComparedTogether` descriptors with all in `among`; row r is that of
// descriptor r, and rows beyond the last descriptor are of no meaning.
void CompareWithAll(std::span<const Descriptor> descriptors, const DescriptorColumns& among,
                    std::array<DistanceRow, kComparedTogether>& rows);

// Replaces `found` by the indices, ascending, whose distance is below the larger of `bound` and the
// index's own element of `bounds`, which has one for each distance.
void FindBelow(const DistanceRow& row, const std::vector<uint8_t>& bounds, uint8_t bound,
               std::vector<int>& found);

}  // namespace oaslam
