#include "oaslam/formats/base64.h"

extern "C" {
#include <libavutil/base64.h>
}

#include <climits>
#include <cstdint>

namespace oaslam {
namespace {

constexpr std::string_view kAlphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

std::optional<std::string> DecodeBase64(std::string_view text) {
  if (text.size() % 4 != 0 || text.size() > INT_MAX) return std::nullopt;
  size_t padding = 0;
  while (padding < 2 && padding < text.size() && text[text.size() - 1 - padding] == '=') ++padding;
  const std::string_view symbols = text.substr(0, text.size() - padding);
  // av_base64_decode ends at the first '=' or zero, and ignores unused bits.
  if (symbols.find_first_not_of(kAlphabet) != std::string_view::npos) return std::nullopt;
  if (padding > 0) {
    const size_t last = kAlphabet.find(symbols.back());
    if (last % (padding == 1 ? 4 : 16) != 0) return std::nullopt;
  }
  std::string bytes(text.size() / 4 * 3 - padding, '\0');
  const int size = av_base64_decode(reinterpret_cast<uint8_t*>(bytes.data()),
                                    std::string(text).c_str(), static_cast<int>(bytes.size()));
  if (size != static_cast<int>(bytes.size())) return std::nullopt;
  return bytes;
}

std::string EncodeBase64(std::string_view bytes) {
  // In pieces of a multiple of three bytes, since av_base64_encode counts by int. It writes a zero
  // behind its text.
  constexpr size_t kPiece = 3 << 20;
  std::string text((bytes.size() + 2) / 3 * 4 + 1, '\0');
  size_t written = 0;
  for (size_t at = 0; at < bytes.size(); at += kPiece) {
    const std::string_view piece = bytes.substr(at, kPiece);
    const size_t length = (piece.size() + 2) / 3 * 4;
    av_base64_encode(text.data() + written, static_cast<int>(length) + 1,
                     reinterpret_cast<const uint8_t*>(piece.data()),
                     static_cast<int>(piece.size()));
    written += length;
  }
  text.resize(written);
  return text;
}

}  // namespace oaslam
