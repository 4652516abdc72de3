#pragma once

#include <atomic>
#include <filesystem>
#include <memory>

#include "oaslam/util/unique_fd.h"

namespace oaslam {

// A folder for files of this process alone, made in `parent`, which is made where it is missing.
// The destructor removes it. What processes have left that died is removed when another one makes
// its folder: a folder whose lock nobody holds is nobody's.
class PrivateFolder {
 public:
  // Throws InputError where that is not possible, also where `parent` belongs to another user.
  explicit PrivateFolder(const std::filesystem::path& parent);
  ~PrivateFolder();
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;

  // A path in it that no other call returns.
  std::filesystem::path NewPath();

 private:
  std::filesystem::path path_;
  UniqueFd lock_;
  std::atomic<int> files_ = 0;
};

// One below the system's folder for temporary files, apart from those of other users.
std::shared_ptr<PrivateFolder> TemporaryFolder();

// Removes a file, if it is there, when the last copy of the result goes. Keeps the folder until
// then.
std::shared_ptr<void> HoldFile(std::shared_ptr<PrivateFolder> folder,
                               const std::filesystem::path& path);

}  // namespace oaslam
