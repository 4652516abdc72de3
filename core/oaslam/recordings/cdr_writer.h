#pragma once

#include <Eigen/Core>
#include <string_view>

#include "oaslam/recordings/record_bytes.h"

namespace oaslam {

// A message of ROS 2, written value by value in its order: CDR, little endian. A value is aligned
// to its size, counted from behind the head.
class CdrWriter {
 public:
  template <typename T>
  CdrWriter& Put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    while ((bytes_.size() - kHead) % sizeof(T) != 0) bytes_.push_back(0);
    Append(&value, sizeof value);
    return *this;
  }
  // The number of elements of a sequence.
  CdrWriter& Count(size_t count) { return Put(static_cast<uint32_t>(count)); }
  CdrWriter& Bytes(ByteView bytes) {
    Count(bytes.size());
    Append(bytes.data(), bytes.size());
    return *this;
  }
  CdrWriter& Text(std::string_view text) {
    Count(text.size() + 1);
    Append(text.data(), text.size());
    return Put(uint8_t{0});
  }
  template <typename Values>
  CdrWriter& All(const Values& values) {
    for (const auto value : values) Put(value);
    return *this;
  }
  CdrWriter& Vector(const Eigen::Vector3d& v) { return Put(v.x()).Put(v.y()).Put(v.z()); }

  ByteView bytes() const { return bytes_; }

 private:
  static constexpr size_t kHead = 4;

  void Append(const void* from, size_t size) {
    const auto* bytes = static_cast<const uint8_t*>(from);
    bytes_.insert(bytes_.end(), bytes, bytes + size);
  }

  ByteBuffer bytes_{0, 1, 0, 0};
};

}  // namespace oaslam
