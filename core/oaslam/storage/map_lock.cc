#include "oaslam/storage/map_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/printable.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds, std::chrono::seconds, std::chrono::steady_clock;

// The process that has a lock on the folder, as the kernel lists it in lines such as
// "1: FLOCK  ADVISORY  WRITE 1234 fe:00:5678 0 EOF".
std::string HolderOf(int folder) {
  struct stat status {};
  if (fstat(folder, &status) != 0) return "another process";
  const std::string inode = fmt::format(":{}", status.st_ino);
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream fields(line);
    std::string number, kind, advisory, mode, process, file;
    if (!(fields >> number >> kind >> advisory >> mode >> process >> file)) continue;
    if (kind != "FLOCK" || !file.ends_with(inode)) continue;
    std::string program;
    std::getline(std::ifstream("/proc/" + process + "/comm"), program);
    return program.empty() ? "process " + process
                           : fmt::format("{} (process {})", Printable(program), process);
  }
  return "another process";
}

// False where the folder cannot be locked.
bool Lock(int folder, const std::string& path, seconds patience) {
  constexpr milliseconds kPause{10};
  constexpr seconds kSilence{2};  // nobody minds such a pause
  const auto start = steady_clock::now();
  bool is_said = false;
  while (flock(folder, LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return false;
    const auto waited = steady_clock::now() - start;
    if (waited > patience)
      throw BadInput("{}: {} has been writing maps in this folder for more than {} s", path,
                     HolderOf(folder), patience.count());
    if (waited > kSilence && !is_said) {
      Log(LogLevel::kWarning, "{}: waits for {}, which writes maps in this folder", path,
          HolderOf(folder));
      is_said = true;
    }
    std::this_thread::sleep_for(kPause);
  }
  return true;
}

}  // namespace

MapLock::MapLock(const std::string& path, std::optional<seconds> patience)
    : path_(path), file_(path) {
  std::error_code error;
  if (const fs::path file = fs::canonical(path, error); !error) file_ = file.string();
  if (!patience) return;
  const std::string folder = fs::absolute(file_, error).parent_path().string();
  UniqueFd fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (fd && Lock(fd.get(), path, *patience)) folder_ = std::move(fd);
}

// A child of this process may have the file descriptor, too: to close it would not do.
MapLock::~MapLock() {
  if (folder_) flock(folder_.get(), LOCK_UN);
}

void MapLock::Sync() const {
  if (folder_) fsync(folder_.get());
}

}  // namespace oaslam
