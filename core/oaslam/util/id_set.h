#pragma once

#include <bitset>
#include <memory>
#include <vector>

namespace oaslam {

// A set of ids. It takes memory only for the ranges of ids that are in it, so that a few ids near
// each other cost little however large they are.
template <typename Id>
class IdSet {
 public:
  // Returns false where the id was in the set already.
  bool Insert(Id id) {
    const size_t page = id.value / kPageSize, place = id.value % kPageSize;
    if (page >= pages_.size()) pages_.resize(page + 1);
    if (!pages_[page]) pages_[page] = std::make_unique<Page>();
    if (pages_[page]->test(place)) return false;
    pages_[page]->set(place);
    return true;
  }

  bool Contains(Id id) const {
    const size_t page = id.value / kPageSize;
    return page < pages_.size() && pages_[page] && pages_[page]->test(id.value % kPageSize);
  }

 private:
  static constexpr size_t kPageSize = 4096;  // ids; 512 bytes for a page of bits
  using Page = std::bitset<kPageSize>;
  std::vector<std::unique_ptr<Page>> pages_;
};

}  // namespace oaslam
