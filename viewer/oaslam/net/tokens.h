#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/net/http_service.h"

namespace oaslam {

// The tokens by which callers may read or write.
class Tokens {
 public:
  // Reads a file with lines "read TOKEN" or "write TOKEN"; # begins a comment. A token has 16
  // characters or more, of letters, digits and -._~. Throws InputError with path and line; warns
  // where other users may read the file.
  static Tokens Load(const std::string& path);

  // What this token allows. The time it takes does not depend on the token.
  Access AccessOf(std::string_view token) const;

 private:
  using Digest = std::array<unsigned char, 32>;
  struct Entry {
    Digest digest{};
    Access access = Access::kNone;
  };
  static Digest DigestOf(std::string_view token);  // SHA-256

  std::vector<Entry> entries_;
};

}  // namespace oaslam
