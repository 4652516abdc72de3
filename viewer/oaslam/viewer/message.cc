#include "oaslam/viewer/message.h"

#include <bit>

namespace oaslam {

static_assert(std::endian::native == std::endian::little, "arrays are sent as they lie in memory");

void MessageBuilder::AddArray(const std::string& name, const char* type,
                              std::span<const std::byte> bytes, size_t count) {
  if (count == 0) return;
  arrays_.push_back({name, type, count});
  body_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  body_.resize((body_.size() + 3) / 4 * 4, '\0');
}

std::string MessageBuilder::Finish() && {
  if (!arrays_.empty()) header["arrays"] = std::move(arrays_);
  // Text that is not valid UTF-8 must not end the program.
  std::string text = header.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto length = static_cast<uint32_t>(text.size());
  std::string message;
  message.reserve(4 + text.size() + body_.size());
  for (int shift = 0; shift < 32; shift += 8)
    message.push_back(static_cast<char>(length >> shift & 0xff));
  return message.append(text).append(body_);
}

}  // namespace oaslam
