#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "oaslam/features/features.h"

namespace oaslam {

// Descriptors by their words, so that the processor compares one with many at a time.
struct DescriptorColumns {
  std::array<std::vector<uint64_t>, 4> words;

  size_t size() const { return words[0].size(); }
  void Add(const Descriptor& descriptor) {
    for (size_t w = 0; w < words.size(); ++w) words[w].push_back(descriptor[w]);
  }
};

struct CloseDescriptor {
  int index = 0;
  int distance = 0;  // Hamming
  bool operator==(const CloseDescriptor&) const = default;
};

// Replaces `close` by all descriptors within `max_distance`, in their order.
void FindClose(const Descriptor& descriptor, const DescriptorColumns& among, int max_distance,
               std::vector<CloseDescriptor>& close);

}  // namespace oaslam
