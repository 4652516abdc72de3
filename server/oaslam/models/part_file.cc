#include "oaslam/models/part_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <thread>
#include <utility>

#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

[[noreturn]] void Refuse(const std::string& path, const char* problem, int error) {
  throw BadInput("{}: {}: {}", path, problem, std::strerror(error));
}

// Returns false if `keep_waiting` does. File systems without locks are used without.
bool Lock(int file, const std::function<bool()>& keep_waiting) {
  while (flock(file, LOCK_EX | LOCK_NB) != 0 && (errno == EWOULDBLOCK || errno == EINTR)) {
    if (!keep_waiting()) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  return true;
}

// Whether the path still names this file: the process that had it may have moved or removed it.
bool IsAt(int file, const std::string& path, int64_t& size) {
  struct stat opened {
  }, named{};
  if (fstat(file, &opened) != 0 || stat(path.c_str(), &named) != 0) return false;
  size = opened.st_size;
  return opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

std::unique_ptr<PartFile> PartFile::Open(const std::string& path,
                                         const std::function<bool()>& keep_waiting) {
  while (true) {
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC | O_NOFOLLOW, 0644);
    if (file < 0) Refuse(path, "cannot be written", errno);
    const bool is_locked = Lock(file, keep_waiting);
    int64_t size = 0;
    if (is_locked && IsAt(file, path, size))
      return std::unique_ptr<PartFile>(new PartFile(path, file, size));
    close(file);
    if (!is_locked) return nullptr;
  }
}

PartFile::PartFile(std::string path, int file, int64_t size)
    : path_(std::move(path)), file_(file), size_(size) {}

PartFile::~PartFile() {
  if (size_ == 0 && !is_moved_) unlink(path_.c_str());
  close(file_);
}

void PartFile::Append(const char* bytes, size_t count) {
  while (count > 0) {
    const ssize_t written = write(file_, bytes, count);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      const int error = errno;
      Clear();
      Refuse(path_, "cannot be written", error);
    }
    bytes += written;
    count -= static_cast<size_t>(written);
    size_ += written;
  }
}

void PartFile::Clear() {
  if (ftruncate(file_, 0) != 0) Refuse(path_, "cannot be written", errno);
  size_ = 0;
}

void PartFile::MoveTo(const std::string& path) {
  if (fsync(file_) != 0) Refuse(path_, "cannot be written", errno);
  if (std::rename(path_.c_str(), path.c_str()) != 0) Refuse(path, "cannot be written", errno);
  is_moved_ = true;
}

}  // namespace oaslam
