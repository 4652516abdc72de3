#include "oaslam/features/descriptor_index.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <numeric>
#include <utility>

#include "oaslam/util/check.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

constexpr int kDescriptorBits = 256;
constexpr uint32_t kMeanBucket = 4;  // larger buckets find more neighbours but take longer
// Of a key: a million landmarks with four views each need 20. Each bit more doubles the tables.
constexpr int kMaxBits = 24;
constexpr size_t kSampled = 4096;  // descriptors: they tell the share of a bit within 1 %

// Bit positions, sorted by how evenly they split the descriptors: even splits make small buckets.
std::vector<uint8_t> BitsByBalance(const std::vector<Descriptor>& descriptors) {
  std::array<int64_t, kDescriptorBits> ones{};
  const size_t step = 1 + descriptors.size() / kSampled;
  int64_t sampled = 0;
  for (size_t i = 0; i < descriptors.size(); i += step, ++sampled)
    for (int b = 0; b < kDescriptorBits; ++b)
      ones[b] += static_cast<int64_t>(descriptors[i][b / 64] >> (b % 64) & 1);
  std::vector<uint8_t> bits(kDescriptorBits);
  std::iota(bits.begin(), bits.end(), uint8_t{0});
  std::ranges::stable_sort(bits, {}, [&](uint8_t b) { return std::abs(2 * ones[b] - sampled); });
  return bits;
}

}  // namespace

uint32_t DescriptorIndex::Key(const Table& table, const Descriptor& descriptor) {
  uint32_t key = 0;
  for (const uint8_t bit : table.bits)
    key = key << 1 | static_cast<uint32_t>(descriptor[bit / 64] >> (bit % 64) & 1);
  return key;
}

DescriptorIndex::DescriptorIndex(std::vector<Descriptor> descriptors, std::vector<uint32_t> labels)
    : descriptors_(std::move(descriptors)), labels_(std::move(labels)) {
  OASLAM_CHECK(descriptors_.size() == labels_.size());
  const uint32_t buckets = static_cast<uint32_t>(descriptors_.size()) / kMeanBucket;
  const int bits = std::clamp(static_cast<int>(std::bit_width(buckets)), 6, kMaxBits);
  std::vector<uint8_t> order = BitsByBalance(descriptors_);
  Rng rng(0x9d5a);
  const int distinct = std::min(kTables * bits, kDescriptorBits);
  for (int i = distinct - 1; i > 0; --i) std::swap(order[i], order[rng.Index(i + 1)]);
  order.resize(static_cast<size_t>(distinct));

  std::vector<uint32_t> keys(descriptors_.size());
  for (int t = 0; t < kTables; ++t) {
    Table& table = tables_[t];
    // Where all tables together have more bits than a descriptor, some bits are used twice.
    for (int b = t * bits; b < (t + 1) * bits; ++b) table.bits.push_back(order[b % distinct]);
    table.begin.assign((size_t{1} << bits) + 1, 0);
    for (size_t i = 0; i < keys.size(); ++i) {
      keys[i] = Key(table, descriptors_[i]);
      ++table.begin[keys[i] + 1];
    }
    std::partial_sum(table.begin.begin(), table.begin.end(), table.begin.begin());
    table.items.resize(keys.size());
    std::vector<uint32_t> next(table.begin.begin(), table.begin.end() - 1);
    for (uint32_t i = 0; i < keys.size(); ++i) table.items[next[keys[i]]++] = i;
  }
}

std::vector<DescriptorIndex::Hit> DescriptorIndex::Query(const Descriptor& descriptor,
                                                         int max_distance, size_t max_hits) const {
  std::vector<Hit> hits;
  if (labels_.empty()) return hits;
  // Most of the time is spent waiting for memory, so that all tables are prefetched before the
  // first is used.
  std::array<uint32_t, kTables> keys;
  for (int t = 0; t < kTables; ++t) {
    keys[t] = Key(tables_[t], descriptor);
    __builtin_prefetch(&tables_[t].begin[keys[t]]);
  }
  for (int t = 0; t < kTables; ++t)
    __builtin_prefetch(tables_[t].items.data() + tables_[t].begin[keys[t]]);
  std::vector<uint32_t> items;
  items.reserve(4 * kTables * kMeanBucket);
  for (int t = 0; t < kTables; ++t) {
    const Table& table = tables_[t];
    for (uint32_t i = table.begin[keys[t]]; i < table.begin[keys[t] + 1]; ++i) {
      items.push_back(table.items[i]);
      __builtin_prefetch(&descriptors_[items.back()]);
    }
  }
  for (const uint32_t item : items) {
    const int distance = HammingDistance(descriptor, descriptors_[item]);
    if (distance <= max_distance) hits.push_back({labels_[item], distance});
  }
  std::ranges::sort(hits, {}, [](const Hit& h) { return std::pair(h.label, h.distance); });
  const auto repeats = std::ranges::unique(hits, {}, &Hit::label);
  hits.erase(repeats.begin(), repeats.end());
  std::ranges::sort(hits, {}, [](const Hit& h) { return std::pair(h.distance, h.label); });
  if (hits.size() > max_hits) hits.resize(max_hits);
  return hits;
}

}  // namespace oaslam
