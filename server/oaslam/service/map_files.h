#pragma once

#include <sys/types.h>

#include <compare>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/service/map_store.h"
#include "oaslam/service/private_folder.h"

namespace oaslam {

// What tells one content of a file from another without reading it.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  int64_t bytes = 0, changed_s = 0, changed_ns = 0;

  auto operator<=>(const FileIdentity&) const = default;
};

// The map files of a folder, or one of them alone, without what is edited while they are served.
// Thread-safe; functions are as those of MapStore.
class MapFiles {
 public:
  explicit MapFiles(const std::filesystem::path& folder_or_file);

  std::vector<StoredMap> Maps();
  std::optional<StoredMap> Find(const std::string& map);
  std::optional<MapFile> Open(const std::string& map);
  void CheckNew(const std::string& map) const;
  StoredMap Put(const std::string& map, const std::filesystem::path& file);
  bool Remove(const std::string& map);

  // The files, by the names of their maps.
  std::map<std::string, FileIdentity> Identities();
  const std::filesystem::path& folder() const { return folder_; }

 private:
  std::vector<std::filesystem::path> PlacesOf(const std::string& map) const;
  std::optional<std::filesystem::path> Locate(const std::string& map) const;
  std::optional<StoredMap> Describe(const std::string& map, const std::filesystem::path& file);

  std::filesystem::path folder_;  // canonical, as is the next
  std::filesystem::path file_;    // the only one; empty: all of the folder
  std::string name_;              // of its map
  std::shared_ptr<PrivateFolder> own_;
  std::mutex mutex_;
  std::map<FileIdentity, std::string> digests_;
};

}  // namespace oaslam
