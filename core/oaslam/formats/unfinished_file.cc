#include "oaslam/formats/unfinished_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>

namespace oaslam {
namespace {

std::string OtherName(const std::string& path, const std::string& extension) {
  static std::atomic<int> files = 0;
  return fmt::format("{}.{}-{}{}", path, getpid(), ++files, extension);
}

}  // namespace

UnfinishedFile::UnfinishedFile(const std::string& path, const std::string& extension)
    : path_(path), name_(OtherName(path, extension)), leftover_(name_) {
  unlink(name_.c_str());  // that of a process of the same number, which was killed
}

UnfinishedFile::~UnfinishedFile() { unlink(name_.c_str()); }

std::error_code UnfinishedFile::Rename() const {
  std::error_code error;
  std::filesystem::rename(name_, path_, error);
  return error;
}

bool IsReplaceable(const std::string& path) {
  std::error_code error;
  const std::filesystem::file_type type = std::filesystem::symlink_status(path, error).type();
  return type == std::filesystem::file_type::regular ||
         type == std::filesystem::file_type::not_found;
}

}  // namespace oaslam
