#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "oaslam/features/features.h"

namespace oaslam {

// Approximate nearest neighbours of binary descriptors by locality-sensitive hashing: tables keyed
// by random bits (Indyk & Motwani 1998), chosen among those that split the descriptors evenly, and
// disjoint as far as there are enough. No vocabulary has to be trained or loaded. Building is
// linear; the same input gives the same index.
class DescriptorIndex {
 public:
  struct Hit {
    uint32_t label = 0;
    int distance = 0;  // Hamming
    bool operator==(const Hit&) const = default;
  };

  DescriptorIndex() = default;
  // Several descriptors may have the same label.
  DescriptorIndex(std::vector<Descriptor> descriptors, std::vector<uint32_t> labels);

  // Labels within `max_distance` that share a bucket with the descriptor: each once with its least
  // distance, nearest first, then by label; at most `max_hits`.
  std::vector<Hit> Query(const Descriptor& descriptor, int max_distance, size_t max_hits) const;

  size_t size() const { return labels_.size(); }

 private:
  // With 256 bits, 16 tables can have disjoint keys of 16 bits, and thus 65536 buckets each. More
  // tables find more neighbours, in proportionally more time and memory.
  static constexpr int kTables = 16;
  struct Table {
    std::vector<uint8_t> bits;    // bit positions that form the key
    std::vector<uint32_t> begin;  // by key: index into items; one more at the end
    std::vector<uint32_t> items;
  };
  static uint32_t Key(const Table& table, const Descriptor& descriptor);

  std::vector<Descriptor> descriptors_;
  std::vector<uint32_t> labels_;
  std::array<Table, kTables> tables_;
};

}  // namespace oaslam
