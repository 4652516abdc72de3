#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <map>
#include <optional>
#include <string>

#include "oaslam/service/map_store.h"

namespace oaslam {

// The anchors of the maps of a folder: a SQLite file that several processes may use at the same
// time. For one thread at a time. Functions throw InputError where the file is damaged, and
// StoreUnavailable where it is locked for long or cannot be written.
class EditFile {
 public:
  // Creates the file where it is missing. Throws InputError for a file that is none of these, or
  // that a newer version has written.
  explicit EditFile(const std::string& path);

  // As those of MapStore.
  AnchorEdits AnchorsSince(const std::string& map, int64_t version);
  std::optional<int64_t> EditAnchor(const std::string& map, const std::string& name,
                                    const std::optional<Anchor>& anchor, bool must_be_new,
                                    const std::string& replaces);

  // Removes what the file has of a map. The version of its anchors ascends all the same.
  void RemoveMap(const std::string& map);
  // Notes that the anchors of the map's file are others (AnchorEdits::map_version).
  void NoteReplacedMap(const std::string& map);

  // A number for each map that ascends with each edit.
  std::map<std::string, int64_t> Versions();
  // A number that changes whenever another EditFile has changed the file.
  int64_t ChangesByOthers();

 private:
  template <typename Act>
  auto Try(Act act);
  void Prepare();
  int64_t NextVersion(const std::string& map);
  void WriteAnchor(const std::string& map, int64_t version, const std::string& name,
                   const std::optional<Anchor>& anchor);

  SQLite::Database database_;
};

}  // namespace oaslam
