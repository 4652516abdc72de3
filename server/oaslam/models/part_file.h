#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace oaslam {

// The beginning of a file that is being fetched. It is kept when a process ends, so that a later
// one goes on, and one process has it at a time. An empty one is removed.
class PartFile {
 public:
  // Opens or creates the file, and waits while another process has it; null if `keep_waiting`,
  // which is called about five times a second, returns false. Throws InputError.
  static std::unique_ptr<PartFile> Open(const std::string& path,
                                        const std::function<bool()>& keep_waiting);
  ~PartFile();
  PartFile(const PartFile&) = delete;
  PartFile& operator=(const PartFile&) = delete;

  int64_t size() const { return size_; }
  const std::string& path() const { return path_; }

  // Throws InputError, for example if the disk is full; then the file is empty.
  void Append(const char* bytes, size_t count);
  void Clear();
  // Gives the file, once it is on the disk, this name, and replaces a file that has it. The file is
  // not used any more afterwards. Throws InputError.
  void MoveTo(const std::string& path);

 private:
  PartFile(std::string path, int file, int64_t size);

  std::string path_;
  int file_;
  int64_t size_;
  bool is_moved_ = false;
};

}  // namespace oaslam
