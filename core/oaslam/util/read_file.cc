#include "oaslam/util/read_file.h"

#include <array>
#include <filesystem>
#include <fstream>

#include "oaslam/util/bad_input.h"

namespace oaslam {

std::string ReadFile(const std::string& path, size_t max_bytes) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) throw BadInput("{}: there is no such file", path);
  if (std::filesystem::is_directory(path, error))
    throw BadInput("{}: is a folder, expected a file", path);
  std::ifstream file(path, std::ios::binary);
  std::string content;
  std::array<char, 1 << 16> part{};
  while (file.read(part.data(), part.size()) || file.gcount() > 0) {
    content.append(part.data(), static_cast<size_t>(file.gcount()));
    if (content.size() > max_bytes)
      throw BadInput("{}: is larger than {} MiB", path, max_bytes >> 20);
  }
  if (!file.is_open() || file.bad()) throw BadInput("{}: cannot be read", path);
  return content;
}

}  // namespace oaslam
