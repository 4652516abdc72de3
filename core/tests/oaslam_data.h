#pragma once

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>

namespace oaslam::testing {

// A file or folder of the real sequences below OASLAM_DATA; nothing where it is absent: the test
// should skip then and say so.
inline std::optional<std::filesystem::path> FindData(const std::string& relative_path) {
  const char* root = std::getenv("OASLAM_DATA");
  if (root == nullptr) return std::nullopt;
  const std::filesystem::path path = std::filesystem::path(root) / relative_path;
  if (!std::filesystem::exists(path)) return std::nullopt;
  return path;
}

}  // namespace oaslam::testing

#define OASLAM_SKIP_WITHOUT_DATA(relative_path)    \
  if (!::oaslam::testing::FindData(relative_path)) \
  GTEST_SKIP() << "needs " << (relative_path) << " under OASLAM_DATA"
