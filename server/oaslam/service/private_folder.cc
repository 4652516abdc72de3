#include "oaslam/service/private_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <string>
#include <system_error>

#include "oaslam/error.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLock = "lock";

UniqueFd OpenLock(const fs::path& folder, int flags) {
  return UniqueFd(open((folder / kLock).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | flags, 0600));
}

void RemoveLeftovers(const fs::path& parent) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(parent, ignored)) {
    if (!entry.is_directory(ignored) || entry.is_symlink(ignored)) continue;
    const UniqueFd lock = OpenLock(entry.path(), 0);
    if (!lock || flock(lock.get(), LOCK_EX | LOCK_NB) == 0) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace

PrivateFolder::PrivateFolder(const fs::path& parent) {
  const auto refuse = [&] {
    throw InputError(parent.string() +
                     ": cannot keep files there: " + std::generic_category().message(errno));
  };
  if (mkdir(parent.c_str(), 0700) != 0 && errno != EEXIST) refuse();
  struct stat status;
  if (lstat(parent.c_str(), &status) != 0) refuse();
  if (!S_ISDIR(status.st_mode) || (status.st_uid != geteuid() && geteuid() != 0))
    throw InputError(parent.string() + ": is no folder of this user");
  // While this is held, no other process takes a folder without a lock for a leftover.
  const UniqueFd all = OpenLock(parent, O_CREAT);
  if (!all || flock(all.get(), LOCK_EX) != 0) refuse();
  RemoveLeftovers(parent);
  std::string name = (parent / "XXXXXX").string();
  if (!mkdtemp(name.data())) refuse();
  path_ = name;
  lock_ = OpenLock(path_, O_CREAT);
  if (!lock_ || flock(lock_.get(), LOCK_EX | LOCK_NB) != 0) refuse();
}

PrivateFolder::~PrivateFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

fs::path PrivateFolder::NewPath() { return path_ / (std::to_string(files_++) + ".map"); }

std::shared_ptr<PrivateFolder> TemporaryFolder() {
  return std::make_shared<PrivateFolder>(fs::temp_directory_path() /
                                         ("oaslam-serve-" + std::to_string(geteuid())));
}

std::shared_ptr<void> HoldFile(std::shared_ptr<PrivateFolder> folder, const fs::path& path) {
  PrivateFolder* const raw = folder.get();
  return {raw, [folder = std::move(folder), path](void*) {
            std::error_code ignored;
            fs::remove(path, ignored);
          }};
}

}  // namespace oaslam
