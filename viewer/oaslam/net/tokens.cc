#include "oaslam/net/tokens.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <sys/stat.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>

#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

constexpr size_t kLeastLength = 16;  // characters: 96 bits if they are random, beyond guessing

bool IsTokenCharacter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) ||
         std::string_view("-._~").find(c) != std::string_view::npos;
}

}  // namespace

Tokens::Digest Tokens::DigestOf(std::string_view token) {
  Digest digest;
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), digest.data());
  return digest;
}

Tokens Tokens::Load(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw InputError(path + ": cannot be read");
  struct stat status {};
  if (stat(path.c_str(), &status) == 0 && (status.st_mode & (S_IRGRP | S_IROTH)) != 0)
    Log(LogLevel::kWarning, path + ": other users may read the tokens; chmod 600 forbids it");
  Tokens tokens;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // of Windows' editors
    std::istringstream fields(line.substr(0, line.find('#')));
    std::string kind, token, rest;
    if (!(fields >> kind)) continue;
    const auto refuse = [&](const std::string& problem) {
      throw BadInput("{}:{}: {}", path, number, problem);
    };
    if (kind != "read" && kind != "write")
      refuse(fmt::format("\"{}\", expected: read TOKEN or write TOKEN", kind));
    if (!(fields >> token) || fields >> rest) refuse("expected one token after " + kind);
    if (token.size() < kLeastLength)
      refuse(
          fmt::format("a token of {} characters, needed: {} or more", token.size(), kLeastLength));
    if (!std::ranges::all_of(token, IsTokenCharacter))
      refuse("a token has letters, digits and -._~ only");
    tokens.entries_.push_back({DigestOf(token), kind == "read" ? Access::kRead : Access::kWrite});
  }
  if (tokens.entries_.empty()) throw InputError(path + ": has no token");
  return tokens;
}

Access Tokens::AccessOf(std::string_view token) const {
  const Digest digest = DigestOf(token);
  Access access = Access::kNone;
  for (const Entry& entry : entries_)
    if (CRYPTO_memcmp(entry.digest.data(), digest.data(), digest.size()) == 0)
      access = std::max(access, entry.access);
  return access;
}

}  // namespace oaslam
