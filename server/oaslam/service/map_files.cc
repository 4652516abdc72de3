#include "oaslam/service/map_files.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <span>
#include <system_error>
#include <utility>

#include "oaslam/crypto/sha256.h"
#include "oaslam/formats/text.h"
#include "oaslam/storage/map_lock.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/printable.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kPatience{10};  // that a client has with another program

[[noreturn]] void ThrowUnavailable(const fs::path& path, int error) {
  throw StoreUnavailable(path.string() + ": " + std::generic_category().message(error));
}

FileIdentity IdentityOf(const struct stat& status) {
  return {status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec,
          status.st_mtim.tv_nsec};
}

// Reads a file to its end.
template <typename Use>
void ReadParts(int fd, const fs::path& path, Use use) {
  std::vector<std::byte> buffer(1 << 20);
  for (;;) {
    const ssize_t bytes = read(fd, buffer.data(), buffer.size());
    if (bytes == 0) return;
    if (bytes < 0 && errno != EINTR) ThrowUnavailable(path, errno);
    if (bytes > 0) use(std::span(buffer.data(), static_cast<size_t>(bytes)));
  }
}

void WriteAll(int fd, const fs::path& path, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno != EINTR) ThrowUnavailable(path, errno);
    if (written > 0) bytes = bytes.subspan(static_cast<size_t>(written));
  }
}

void Copy(const fs::path& from, const fs::path& to) {
  const UniqueFd source(open(from.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
  if (!source) ThrowUnavailable(from, errno);
  const UniqueFd target(open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (!target) ThrowUnavailable(to, errno);
  ReadParts(source.get(), from,
            [&](std::span<const std::byte> bytes) { WriteAll(target.get(), to, bytes); });
  if (fsync(target.get()) != 0) ThrowUnavailable(to, errno);
}

// A rename or a removal survives a loss of power only once the folder itself is on the disk.
void SyncFolder(const fs::path& folder) {
  const UniqueFd fd(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || fsync(fd.get()) != 0) ThrowUnavailable(folder, errno);
}

bool IsInside(const fs::path& path, const fs::path& folder) {
  const fs::path relative = path.lexically_relative(folder);
  return !relative.empty() && *relative.begin() != "..";
}

// The names of files and folders that may be maps.
std::vector<fs::path> FilesOfMaps(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> files;
  fs::directory_iterator entries(folder, error);
  if (error) ThrowUnavailable(folder, error.value());
  for (; entries != fs::directory_iterator(); entries.increment(error)) {
    const fs::path name = entries->path().filename();
    if (name.extension() == ".map" || name.extension() == ".oaslam") files.push_back(name);
  }
  if (error) ThrowUnavailable(folder, error.value());
  return files;
}

// While a map is replaced or removed, no other program edits one in its folder.
MapLock LockMap(const fs::path& file) {
  try {
    return MapLock(file, kPatience);
  } catch (const InputError& error) {
    throw StoreUnavailable(error.what());
  }
}

bool IsMapName(const std::string& name) {
  try {
    CheckMapName(name);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

MapFiles::MapFiles(const fs::path& folder_or_file) {
  std::error_code error;
  folder_ = fs::canonical(folder_or_file, error);
  if (!error && fs::is_regular_file(folder_, error)) {
    name_ = folder_or_file.stem();
    CheckMapName(name_);
    file_ = std::exchange(folder_, folder_.parent_path());
  }
  if (error || !fs::is_directory(folder_, error))
    throw InputError(folder_or_file.string() +
                     ": is neither a folder nor a map file that can be read");
  if (access(folder_.c_str(), R_OK | W_OK | X_OK) != 0)
    throw InputError((file_.empty() ? folder_or_file : folder_).string() +
                     ": must be writable, for the anchors that are edited while maps are served");
  own_ = std::make_shared<PrivateFolder>(folder_ / ".oaslam-serve");
  if (!file_.empty()) return;
  for (const fs::path& file : FilesOfMaps(folder_))
    if (!IsMapName(file.stem()) && !file.string().starts_with('.'))
      Log(LogLevel::kWarning,
          "{}: is not served: its name has a control character, is not UTF-8, or is "
          "longer than 200 bytes",
          OnOneLine(Printable((folder_ / file).string()), 1000));
}

// Where in the folder the file of a map may be.
std::vector<fs::path> MapFiles::PlacesOf(const std::string& map) const {
  if (file_.empty()) return {map + ".map", map + ".oaslam", map + ".oaslam/map.oaslam"};
  if (map == name_) return {file_.filename()};
  return {};
}

// The path of the file of a map. A link is followed within the folder only.
std::optional<fs::path> MapFiles::Locate(const std::string& map) const {
  CheckMapName(map);
  for (const fs::path& place : PlacesOf(map)) {
    std::error_code error;
    const fs::path path = fs::canonical(folder_ / place, error);
    if (!error && fs::is_regular_file(path, error) && IsInside(path, folder_)) return path;
  }
  // A folder that cannot be reached (a network drive, for example) does not mean that the map is
  // gone.
  if (access(folder_.c_str(), R_OK | X_OK) != 0) ThrowUnavailable(folder_, errno);
  return std::nullopt;
}

// Nothing where the file is gone.
std::optional<StoredMap> MapFiles::Describe(const std::string& map, const fs::path& file) {
  // A file that changes while it is read is read again.
  for (int attempt = 0; attempt < 3; ++attempt) {
    const UniqueFd fd(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    struct stat status;
    if (!fd && errno == ENOENT) return std::nullopt;
    if (!fd || fstat(fd.get(), &status) != 0) ThrowUnavailable(file, errno);
    const FileIdentity identity = IdentityOf(status);
    StoredMap stored{
        map, "", static_cast<uint64_t>(identity.bytes),
        static_cast<double>(identity.changed_s) + 1e-9 * static_cast<double>(identity.changed_ns)};
    {
      const std::scoped_lock lock(mutex_);
      if (const auto known = digests_.find(identity); known != digests_.end()) {
        stored.digest = known->second;
        return stored;
      }
    }
    Sha256 digest;
    ReadParts(fd.get(), file, [&](std::span<const std::byte> bytes) { digest.Add(bytes); });
    if (fstat(fd.get(), &status) != 0) ThrowUnavailable(file, errno);
    if (IdentityOf(status) != identity) continue;
    stored.digest = digest.Hex();
    const std::scoped_lock lock(mutex_);
    // Most are of files that are gone by then.
    constexpr size_t kMostDigests = 10'000;  // some megabytes
    if (digests_.size() >= kMostDigests) digests_.clear();
    digests_[identity] = stored.digest;
    return stored;
  }
  throw StoreUnavailable(file.string() + ": is being written");
}

std::map<std::string, FileIdentity> MapFiles::Identities() {
  std::map<std::string, FileIdentity> found;
  std::vector<std::string> maps;
  if (!file_.empty())
    maps.push_back(name_);
  else
    for (const fs::path& file : FilesOfMaps(folder_)) maps.push_back(file.stem());
  for (const std::string& map : maps) {
    if (!IsMapName(map)) continue;
    const std::optional<fs::path> path = Locate(map);
    struct stat status;
    if (path && stat(path->c_str(), &status) == 0) found[map] = IdentityOf(status);
  }
  return found;
}

std::vector<StoredMap> MapFiles::Maps() {
  std::vector<StoredMap> maps;
  for (const auto& [map, identity] : Identities())
    if (std::optional<StoredMap> stored = Find(map)) maps.push_back(std::move(*stored));
  return maps;
}

std::optional<StoredMap> MapFiles::Find(const std::string& map) {
  const std::optional<fs::path> path = Locate(map);
  return path ? Describe(map, *path) : std::nullopt;
}

std::optional<MapFile> MapFiles::Open(const std::string& map) {
  MapFile file;
  file.path = own_->NewPath();
  file.hold = HoldFile(own_, file.path);
  constexpr int kAttempts = 100;  // each fails only if the file is replaced at this very moment
  for (int attempt = 0;; ++attempt) {
    const std::optional<fs::path> path = Locate(map);
    if (!path) return std::nullopt;
    if (link(path->c_str(), file.path.c_str()) == 0) break;
    // The file was replaced after it was found: another one has its name now.
    if (errno == ENOENT && attempt < kAttempts) continue;
    Copy(*path, file.path);
    break;
  }
  std::optional<StoredMap> stored = Describe(map, file.path);
  if (!stored) ThrowUnavailable(file.path, ENOENT);
  file.map = std::move(*stored);
  return file;
}

void MapFiles::CheckNew(const std::string& map) const {
  CheckMapName(map);
  if (!file_.empty() && map != name_)
    throw BadInput("the map \"{}\" alone is served, no other can be stored", name_);
}

StoredMap MapFiles::Put(const std::string& map, const fs::path& file) {
  CheckNew(map);
  std::error_code error;
  const fs::path source = fs::canonical(file, error);
  if (error || !fs::is_regular_file(source, error))
    throw InputError(file.string() + ": cannot be read");
  const fs::path target = Locate(map).value_or(folder_ / PlacesOf(map).front());
  const fs::path copy = own_->NewPath();
  const std::shared_ptr<void> hold = HoldFile(own_, copy);
  Copy(source, copy);
  std::optional<StoredMap> stored = Describe(map, copy);
  if (!stored) ThrowUnavailable(copy, ENOENT);
  const MapLock lock = LockMap(target);
  if (rename(copy.c_str(), target.c_str()) != 0) ThrowUnavailable(target, errno);
  SyncFolder(target.parent_path());
  return *stored;
}

bool MapFiles::Remove(const std::string& map) {
  bool was_there = false;
  // Another file of this name may stand behind the first one.
  while (const std::optional<fs::path> path = Locate(map)) {
    const MapLock lock = LockMap(*path);
    if (unlink(path->c_str()) != 0 && errno != ENOENT) ThrowUnavailable(*path, errno);
    SyncFolder(path->parent_path());
    was_there = true;
  }
  return was_there;
}

}  // namespace oaslam
