#pragma once

#include <filesystem>
#include <optional>

namespace oaslam {

// A folder of the user by the XDG Base Directory Specification: the one that the environment names
// in `variable` (XDG_DATA_HOME), else `below_home` (".local/share") in HOME. Relative paths in the
// environment are ignored, as the specification says. Nothing where neither is set.
std::optional<std::filesystem::path> UserFolder(const char* variable, const char* below_home);

}  // namespace oaslam
