#include "oaslam/formats/unicode.h"

#include <utf8proc.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <vector>

namespace oaslam {
namespace {

bool IsAscii(const std::string& text) {
  return std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

}  // namespace

std::string Composed(const std::string& name) {
  if (IsAscii(name)) return name;
  utf8proc_uint8_t* bytes = nullptr;
  const auto length =
      utf8proc_map(reinterpret_cast<const utf8proc_uint8_t*>(name.data()),
                   static_cast<utf8proc_ssize_t>(name.size()), &bytes,
                   static_cast<utf8proc_option_t>(UTF8PROC_STABLE | UTF8PROC_COMPOSE));
  const std::unique_ptr<utf8proc_uint8_t, decltype(&std::free)> owned(bytes, &std::free);
  if (length < 0) return name;
  return {reinterpret_cast<const char*>(bytes), static_cast<size_t>(length)};
}

std::string FileInEitherForm(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (IsAscii(path) || fs::exists(path, error)) return path;
  fs::path found;
  for (const fs::path& part : fs::path(path)) {
    if (fs::exists(found / part, error) || IsAscii(part)) {
      found /= part;
      continue;
    }
    std::vector<fs::path> same;
    for (fs::directory_iterator entry(found.empty() ? "." : found, error), end; entry != end;
         entry.increment(error))
      if (Composed(entry->path().filename()) == Composed(part))
        same.push_back(entry->path().filename());
    if (same.size() != 1) return path;
    found /= same.front();
  }
  return found.string();
}

}  // namespace oaslam
