#include "oaslam/crypto/base64.h"

#include <openssl/evp.h>

#include <climits>

namespace oaslam {
namespace {

constexpr std::string_view kAlphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

const unsigned char* Bytes(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

unsigned char* Bytes(std::string& text) { return reinterpret_cast<unsigned char*>(text.data()); }

}  // namespace

std::optional<std::string> DecodeBase64(std::string_view text) {
  if (text.size() % 4 != 0 || text.size() > INT_MAX) return std::nullopt;
  size_t padding = 0;
  while (padding < 2 && padding < text.size() && text[text.size() - 1 - padding] == '=') ++padding;
  const std::string_view symbols = text.substr(0, text.size() - padding);
  // EVP_DecodeBlock ignores blanks at both ends and takes '=' for a symbol.
  if (symbols.find_first_not_of(kAlphabet) != std::string_view::npos) return std::nullopt;
  if (padding > 0) {
    const size_t last = kAlphabet.find(symbols.back());
    if (last % (padding == 1 ? 4 : 16) != 0) return std::nullopt;
  }
  std::string bytes(text.size() / 4 * 3, '\0');
  if (EVP_DecodeBlock(Bytes(bytes), Bytes(text), static_cast<int>(text.size())) < 0)
    return std::nullopt;
  bytes.erase(text.size() / 4 * 3 - padding);
  return bytes;
}

std::string EncodeBase64(std::string_view bytes) {
  // In submaps of a multiple of three bytes, since EVP_EncodeBlock counts by int. It writes a zero
  // behind its text.
  constexpr size_t kSubmap = 3 << 20;
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  size_t written = 0;
  for (size_t at = 0; at < bytes.size(); at += kSubmap) {
    const std::string_view submap = bytes.substr(at, kSubmap);
    written += static_cast<size_t>(
        EVP_EncodeBlock(Bytes(text) + written, Bytes(submap), static_cast<int>(submap.size())));
  }
  text.resize(written);
  return text;
}

}  // namespace oaslam
