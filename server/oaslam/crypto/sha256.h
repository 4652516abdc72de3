#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace oaslam {

// The digest of FIPS 180-4, of bytes that come in parts.
class Sha256 {
 public:
  Sha256();
  void Add(std::span<const std::byte> bytes);
  // In hexadecimal; the last call.
  std::string Hex();

 private:
  std::shared_ptr<void> context_;
};

// The same of bytes that are here.
std::string Sha256Of(std::string_view bytes);

}  // namespace oaslam
