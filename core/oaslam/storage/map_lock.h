#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "oaslam/util/unique_fd.h"

namespace oaslam {

// The right to replace the files of one folder. While one process has it, others that ask for it
// wait, so that of two edits of a map each begins with the result of the other. It is a lock
// (flock) on the folder, which stays when a file in it is replaced: it leaves no file behind, and
// ends with the process, however that ends. Not for the thread that has it already.
class MapLock {
 public:
  // How long a writer may take; more than a map of a building needs.
  static constexpr std::chrono::seconds kPatience{60};

  // For the file at `path`, or the one that a link there leads to. Waits, and throws InputError,
  // which names the process that has the lock, where that takes longer than `patience`. A folder
  // that cannot be locked, as on some network drives, is used without a lock.
  explicit MapLock(const std::string& path, std::chrono::seconds patience = kPatience)
      : MapLock(path, std::optional(patience)) {}
  // One that nobody waits for: for a file that no other process writes.
  static MapLock NotHeld(const std::string& path) { return {path, std::nullopt}; }
  ~MapLock();
  MapLock(MapLock&&) noexcept = default;

  bool IsHeld() const { return static_cast<bool>(folder_); }
  const std::string& path() const { return path_; }  // as it was given
  // The file itself, where the path is that of a link.
  const std::string& file() const { return file_; }
  // Writes the entries of the folder to the disk, as far as that can be done.
  void Sync() const;

 private:
  MapLock(const std::string& path, std::optional<std::chrono::seconds> patience);

  std::string path_, file_;
  UniqueFd folder_;
};

}  // namespace oaslam
