#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/util/check.h"

namespace oaslam {

// A number that no other table of this process has, whichever shared library made that table.
// Epochs only decide which pages are copied; no result depends on them.
OASLAM_API uint64_t NewTableEpoch();

// A table of values by id with value semantics. A copy shares the pages of the original until one
// side changes them, so that a snapshot costs one pointer per page. Ids ascend and are never
// reused; an erased id is not found. Iteration is in the order of ids. Thread safety is that of
// std::vector; in addition, copies of one table may be used in different threads.
template <typename Id, typename T>
class Table {
  // Larger pages cost more to copy for each change; smaller ones mean more pointers in each
  // snapshot.
  static constexpr uint32_t kPageSize = 64;

  // The values of 64 ids. Most ids of a real map are of landmarks that were erased soon, so that
  // memory is taken for eight values at a time, in the order in which they came. A value stays in
  // its place until it is erased.
  class Page {
   public:
    Page() { places_.fill(kNone); }
    // The copy has no gaps.
    Page(const Page& other) : Page() {
      for (uint32_t slot = 0; slot < kPageSize; ++slot)
        if (const T* value = other.Find(slot)) Insert(slot, *value);
    }
    Page& operator=(const Page&) = delete;

    const T* Find(uint32_t slot) const {
      const uint8_t place = places_[slot];
      return place == kNone ? nullptr : &*(*chunks_[place / kChunk])[place % kChunk];
    }
    T* Find(uint32_t slot) { return const_cast<T*>(std::as_const(*this).Find(slot)); }
    T& Insert(uint32_t slot, T value) {
      const uint8_t place = FreePlace();
      std::unique_ptr<Chunk>& chunk = chunks_[place / kChunk];
      if (!chunk) chunk = std::make_unique<Chunk>();
      places_[slot] = place;
      ++size_;
      return (*chunk)[place % kChunk].emplace(std::move(value));
    }
    void Erase(uint32_t slot) {
      const uint8_t place = std::exchange(places_[slot], kNone);
      (*chunks_[place / kChunk])[place % kChunk].reset();
      --size_;
    }
    uint32_t size() const { return size_; }

    uint64_t owner = 0;  // the epoch of the one table that may write to this page

   private:
    static constexpr uint32_t kChunk = 8;  // values that are allocated together
    static constexpr uint8_t kNone = 255;  // no place; above all places in a page
    using Chunk = std::array<std::optional<T>, kChunk>;

    uint8_t FreePlace() {
      if (end_ < kPageSize) return end_++;
      uint8_t place = 0;
      while ((*chunks_[place / kChunk])[place % kChunk]) ++place;
      return place;
    }

    std::array<uint8_t, kPageSize> places_;  // by slot
    uint8_t size_ = 0, end_ = 0;             // values; places before `end_` were used
    std::array<std::unique_ptr<Chunk>, kPageSize / kChunk> chunks_;
  };

 public:
  Table() : epoch_(NewTableEpoch()) {}
  Table(const Table& other) : pages_(other.pages_), size_(other.size_), epoch_(NewTableEpoch()) {
    other.epoch_ = NewTableEpoch();
  }
  Table(Table&& other) noexcept
      : pages_(std::move(other.pages_)), size_(other.size_), epoch_(other.epoch_.load()) {
    other.size_ = 0;
    other.epoch_ = NewTableEpoch();
  }
  Table& operator=(const Table& other) {
    if (this != &other) *this = Table(other);
    return *this;
  }
  Table& operator=(Table&& other) noexcept {
    pages_ = std::move(other.pages_);
    size_ = other.size_;
    epoch_ = other.epoch_.load();
    other.size_ = 0;
    other.epoch_ = NewTableEpoch();
    return *this;
  }

  const T* Find(Id id) const {
    const uint32_t page = id.value / kPageSize;
    if (page >= pages_.size() || !pages_[page]) return nullptr;
    return std::as_const(*pages_[page]).Find(id.value % kPageSize);
  }
  const T& At(Id id) const {
    const T* value = Find(id);
    OASLAM_CHECK(value != nullptr);
    return *value;
  }
  bool Contains(Id id) const { return Find(id) != nullptr; }

  // Returns the value for writing, or null; copies the page if a snapshot shares it. Pointers and
  // references obtained earlier from Find or At of this table still refer to the old value and must
  // be obtained again.
  T* Mutable(Id id) {
    if (!Contains(id)) return nullptr;
    return OwnPage(id.value / kPageSize).Find(id.value % kPageSize);
  }
  T& MutableAt(Id id) {
    T* value = Mutable(id);
    OASLAM_CHECK(value != nullptr);
    return *value;
  }

  T& Insert(Id id, T value) {
    OASLAM_CHECK(id.IsValid() && !Contains(id));
    const uint32_t page = id.value / kPageSize;
    if (page >= pages_.size()) pages_.resize(page + 1);
    ++size_;
    return OwnPage(page).Insert(id.value % kPageSize, std::move(value));
  }

  bool Erase(Id id) {
    if (!Contains(id)) return false;
    const uint32_t page = id.value / kPageSize;
    OwnPage(page).Erase(id.value % kPageSize);
    --size_;
    if (pages_[page]->size() == 0) pages_[page].reset();
    return true;
  }

  // Moves all values of another table into this one; no id may be in both.
  void Take(Table&& other) {
    if (other.pages_.size() > pages_.size()) pages_.resize(other.pages_.size());
    size_t left = other.size_;
    for (uint32_t page = static_cast<uint32_t>(other.pages_.size()); left > 0;) {
      std::shared_ptr<Page>& from = other.pages_[--page];
      if (!from) continue;
      const size_t count = from->size();
      left -= count;
      if (!pages_[page] && from->owner == other.epoch_) {
        from->owner = epoch_;
        pages_[page] = std::move(from);
        size_ += count;
        continue;
      }
      for (uint32_t slot = 0; slot < kPageSize; ++slot)
        if (const T* value = from->Find(slot)) Insert(Id(page * kPageSize + slot), *value);
    }
    other = Table();
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

  // The lowest id; invalid in an empty table.
  Id First() const { return FirstFrom(Id(0)); }
  // The lowest id that is not below `from`; invalid where there is none.
  Id FirstFrom(Id from) const {
    uint32_t slot = from.value % kPageSize;
    for (uint32_t page = from.value / kPageSize; page < pages_.size(); ++page, slot = 0)
      for (; pages_[page] && slot < kPageSize; ++slot)
        if (pages_[page]->Find(slot)) return Id(page * kPageSize + slot);
    return {};
  }
  // Larger than all ids.
  Id Bound() const { return Id(static_cast<uint32_t>(pages_.size()) * kPageSize); }

  // Calls visit(id, const T&) in ascending order of ids; visit must not change the table.
  template <typename Visitor>
  void ForEach(Visitor&& visit) const {
    for (uint32_t page = 0; page < pages_.size(); ++page) {
      if (!pages_[page]) continue;
      for (uint32_t slot = 0; slot < kPageSize; ++slot)
        if (const T* value = std::as_const(*pages_[page]).Find(slot))
          visit(Id(page * kPageSize + slot), *value);
    }
  }

  // Calls visit(id, before, now), in ascending order, for the ids whose value may have changed
  // since `earlier`, a copy of this table; a null pointer stands for no value. Pages that both
  // share are skipped, so that this takes time for changes only.
  template <typename Visitor>
  void ForEachDifference(const Table& earlier, Visitor&& visit) const {
    const size_t count = std::max(pages_.size(), earlier.pages_.size());
    for (uint32_t page = 0; page < count; ++page) {
      const Page* before = page < earlier.pages_.size() ? earlier.pages_[page].get() : nullptr;
      const Page* now = page < pages_.size() ? pages_[page].get() : nullptr;
      if (before == now) continue;
      for (uint32_t slot = 0; slot < kPageSize; ++slot) {
        const T* a = before ? before->Find(slot) : nullptr;
        const T* b = now ? now->Find(slot) : nullptr;
        if (a || b) visit(Id(page * kPageSize + slot), a, b);
      }
    }
  }

  std::vector<Id> Ids() const {
    std::vector<Id> ids;
    ids.reserve(size_);
    ForEach([&](Id id, const T&) { ids.push_back(id); });
    return ids;
  }

 private:
  Page& OwnPage(uint32_t index) {
    std::shared_ptr<Page>& page = pages_[index];
    if (!page) {
      page = std::make_shared<Page>();
      page->owner = epoch_;
    } else if (page->owner != epoch_) {
      page = std::make_shared<Page>(*page);
      page->owner = epoch_;
    }
    return *page;
  }

  std::vector<std::shared_ptr<Page>> pages_;
  size_t size_ = 0;
  mutable std::atomic<uint64_t> epoch_;
};

}  // namespace oaslam
