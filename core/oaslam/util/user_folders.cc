#include "oaslam/util/user_folders.h"

#include <cstdlib>

namespace oaslam {
namespace {

std::optional<std::filesystem::path> AbsolutePathIn(const char* variable) {
  const char* value = std::getenv(variable);
  const std::filesystem::path path = value != nullptr ? value : "";
  return path.is_absolute() ? std::optional(path) : std::nullopt;
}

}  // namespace

std::optional<std::filesystem::path> UserFolder(const char* variable, const char* below_home) {
  if (const auto folder = AbsolutePathIn(variable)) return folder;
  if (const auto home = AbsolutePathIn("HOME")) return *home / below_home;
  return std::nullopt;
}

}  // namespace oaslam
