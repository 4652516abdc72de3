#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/util/unique_fd.h"

namespace oaslam {

using ByteView = std::span<const uint8_t>;
using ByteBuffer = std::vector<uint8_t>;

// Records are written by little-endian values, which are read as they lie in memory.
static_assert(std::endian::native == std::endian::little);

// The most that is taken into memory at once: no recorder writes a chunk or a message as large.
inline constexpr uint64_t kLongestRecord = uint64_t{1} << 30;

// The values of a recording one after another, in a file or in memory. A file is read as far as it
// is taken: what is skipped costs nothing, and a forked child has a position of its own. What
// fails throws an InputError, which names the file and the offset.
class RecordBytes {
 public:
  // Opens a file; `name` is what messages call it.
  RecordBytes(const std::string& path, std::string name);
  // A part of a file that was decompressed; `place` is what Refuse begins with. The bytes must
  // outlive this.
  RecordBytes(ByteView memory, std::string place);

  uint64_t at() const { return at_; }
  uint64_t size() const { return size_; }
  uint64_t left() const { return end_ - at_; }
  // From now on nothing behind `end` is read, at most the size; returns the end so far.
  uint64_t SetEnd(uint64_t end);

  // The next bytes, which are valid until the next call. Throws where fewer are left.
  ByteView Take(uint64_t count);
  void Skip(uint64_t count);
  // Returns to what was taken last.
  void GoBack(uint64_t count) { at_ -= count; }
  template <typename T>
  T Get() {
    T value;
    std::memcpy(&value, Take(sizeof value).data(), sizeof value);
    return value;
  }
  // A text behind its length, which has four bytes.
  std::string Text();

  [[noreturn]] void Refuse(const std::string& problem) const;
  // "drive.bag: at byte 4096"
  std::string Place() const;

 private:
  void Need(uint64_t count) const;

  std::string place_;
  UniqueFd file_;
  ByteView memory_;
  ByteBuffer window_;         // of the file
  uint64_t window_from_ = 0;  // its offset in the file
  uint64_t at_ = 0, end_ = 0, size_ = 0;
};

}  // namespace oaslam
