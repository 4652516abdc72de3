#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "oaslam/map/anchor.h"

namespace oaslam {

// The store cannot be reached now; the same request may succeed later.
class StoreUnavailable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A map as it is stored: one version of a map file.
struct StoredMap {
  std::string name;
  std::string digest;  // SHA-256 of the file, in hexadecimal
  uint64_t bytes = 0;
  double changed = 0;  // seconds since 1970

  bool operator==(const StoredMap&) const = default;
};

// A file with one version of a map. It stays as it is while this exists, also when the map is
// replaced or removed.
struct MapFile {
  StoredMap map;
  std::filesystem::path path;
  std::shared_ptr<void> hold;  // keeps the file
};

// The newest edit of an anchor of a map.
struct AnchorEntry {
  std::string name;
  int64_t version = 0;           // that the map's anchors had after this edit
  std::optional<Anchor> anchor;  // nothing: it was removed
};

struct AnchorEdits {
  int64_t version = 0;  // of the map's anchors; each edit makes a new one, ascending
  // That the anchors had when the map was removed or replaced last: edits of before, and anchors
  // of the file of before, may be gone without an entry. 0: never.
  int64_t map_version = 0;
  std::vector<AnchorEntry> entries;
};

// Throws InputError where a map cannot have this name: 1 to 200 bytes of UTF-8, no '/' and no
// control character among them, the first no '.'.
void CheckMapName(const std::string& name);

// Where the maps of a service are, with the anchors that are edited while they are served.
// Thread-safe; other servers may use the same store at the same time. Edits are
// whole, and of two edits of one anchor the later one wins. Functions throw InputError for a name
// that cannot be one, and StoreUnavailable.
class MapStore {
 public:
  virtual ~MapStore() = default;

  virtual std::vector<StoredMap> Maps() = 0;  // in the order of their names
  virtual std::optional<StoredMap> Find(const std::string& map) = 0;
  // Nothing where there is no such map.
  virtual std::optional<MapFile> Open(const std::string& map) = 0;
  // Throws InputError where Put would refuse a map of this name.
  virtual void CheckNew(const std::string& map) { CheckMapName(map); }
  // Stores a copy of a map file, in place of the map of that name if there is one; readers have
  // the old one or the new one. The file was checked before. The anchors stay; to replace a map is
  // an edit of them all the same, since those of its file are others.
  virtual StoredMap Put(const std::string& map, const std::filesystem::path& file) = 0;
  // Removes a map with its anchors, which is an edit of them. False where there is none.
  virtual bool Remove(const std::string& map) = 0;

  // The newest edit of each anchor that was edited after `version`; 0: all edits.
  virtual AnchorEdits AnchorsSince(const std::string& map, int64_t version) = 0;
  // Creates, replaces or (without an anchor) removes one. Returns the new version. A new one of
  // this name is refused, and nothing returned, where `must_be_new` and the store has one.
  // `replaces`: another anchor that is removed in the same step, as by a rename; empty: none.
  virtual std::optional<int64_t> EditAnchor(const std::string& map, const std::string& name,
                                            const std::optional<Anchor>& anchor, bool must_be_new,
                                            const std::string& replaces = {}) = 0;

  // Calls `changed` with the name of each map that has changed, or whose anchors have, on a thread
  // of the store's, within a second of the change, whoever made it. An empty name: anything may
  // have changed (the store could not be reached for a while).
  virtual void Watch(std::function<void(const std::string& map)> changed) = 0;
  // `changed` is called no more once this has returned.
  virtual void EndWatch() = 0;
};

// The maps of a folder: NAME.map and NAME.oaslam files, and map.oaslam in folders NAME.oaslam as
// `oaslam run` makes them. Anchors are in one SQLite file in it. Where the location is a map file,
// it is the only map, with its anchors in that SQLite file of its folder. With a location that
// begins with postgresql:// or postgres://, those of a PostgreSQL database, whose tables are
// created where they are missing. Throws InputError where the location cannot be used.
std::unique_ptr<MapStore> OpenMapStore(const std::string& location);
// Its two kinds. A single file is not read here.
std::unique_ptr<MapStore> OpenMapFolder(const std::string& folder_or_file);
std::unique_ptr<MapStore> OpenMapDatabase(const std::string& location);

// Throws InputError where a store cannot keep this edit: a name or a model that is not 1 to 64
// bytes of UTF-8 without control characters, or a number that is not finite.
void CheckAnchorEdit(const std::string& name, const std::optional<Anchor>& anchor);

}  // namespace oaslam
