#pragma once

#include <functional>
#include <optional>
#include <string>

#include "oaslam/config.h"
#include "oaslam/storage/map_edit.h"
#include "oaslam/system/edit_takeover.h"

namespace oaslam::apps {

// The map file that a command writes at its end. Other programs may write the file while the
// command works: the anchors and objects that they edited are taken over; if they wrote another
// map, the file stays as it is, and the command's map is saved beside it.
class MapOut {
 public:
  // Remembers what the file has now. `path`: empty where the command saves no map.
  explicit MapOut(std::string path);

  // The command works on the map of this file as it has read it.
  void BeginsWith(const std::string& file, const Map& map);
  // No longer.
  void BeginsAnew() { read_.reset(); }

  // Takes over the edits that others have made in the file. From now on they wait with further
  // ones, until Release or the end. Before the map's unit is changed; may be called again, with
  // another result of the same command.
  void TakeOverEdits(const ObjectsConfig& config, Map& map);
  // Saves the map. Throws InputError, after it was saved, where it is beside the file.
  void Save(const SavedMap& saved);
  // Lets others write the file.
  void Release() { lock_.reset(); }

 private:
  void Lock();

  std::string path_;
  std::optional<MapState> before_;
  std::optional<EditedContent> read_;
  std::optional<MapLock> lock_;
  std::optional<Map> edited_;  // of the file, where only edits were made in it
  std::string why_beside_;     // empty: the file is replaced
  std::string beside_;         // the file that is written instead
};

// Calls `edit` with the map of a file, and saves the result: in place, while others that edit maps
// there wait, or to `out` if a path is given. Saves nothing if there is no path and the map
// `is_edited` not.
void EditOrCopy(const std::string& map, const std::string& out, bool is_edited,
                const std::function<void(SavedMap&)>& edit);

}  // namespace oaslam::apps
