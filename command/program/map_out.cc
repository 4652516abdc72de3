#include "map_out.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

namespace fs = std::filesystem;

// The path of a file that is not there yet: "a-2.map" for "a.map".
std::string PathBeside(const std::string& path) {
  const fs::path file(path);
  std::error_code error;
  for (int i = 2;; ++i) {
    const fs::path beside = file.parent_path() / fmt::format("{}-{}{}", file.stem().string(), i,
                                                             file.extension().string());
    if (!fs::exists(beside, error)) return beside.string();
  }
}

}  // namespace

MapOut::MapOut(std::string path) : path_(std::move(path)) {
  if (!path_.empty()) before_ = StateOfMap(path_);
}

void MapOut::BeginsWith(const std::string& file, const Map& map) {
  std::error_code error;
  if (!path_.empty() && fs::equivalent(MapFileAt(file), path_, error)) read_ = EditedContentOf(map);
}

// Finds out, once, what others have made of the file.
void MapOut::Lock() try {
  if (lock_ || path_.empty() || !why_beside_.empty()) return;
  lock_.emplace(path_);
  const std::optional<MapState> now = StateOfMap(path_);
  if (now == before_ || !now) return;
  why_beside_ = "another program has written it meanwhile";
  if (!read_ || !before_ || now->scene != before_->scene) return;
  edited_ = LoadMap(path_).map;
  why_beside_.clear();
} catch (const InputError& error) {
  why_beside_ = error.what();
}

void MapOut::TakeOverEdits(const ObjectsConfig& config, Map& map) {
  Lock();
  if (!edited_) return;
  const std::string problem = oaslam::TakeOverEdits(*read_, *edited_, config, map);
  if (!problem.empty()) why_beside_ = "another program has edited it meanwhile, and " + problem;
}

void MapOut::Save(const SavedMap& saved) {
  if (path_.empty()) return;
  Lock();
  if (why_beside_.empty()) return SaveMap(saved, *lock_);
  if (beside_.empty()) beside_ = PathBeside(path_);
  SaveMap(saved, MapLock::NotHeld(beside_));
  throw BadInput("{}: it stays as it is, and the new map is in {}: {}", path_, beside_,
                 why_beside_);
}

void EditOrCopy(const std::string& map, const std::string& out, bool is_edited,
                const std::function<void(SavedMap&)>& edit) {
  if (is_edited && out.empty()) return EditMap(map, edit);
  SavedMap saved = LoadMap(map);
  edit(saved);
  if (!out.empty()) SaveMap(out, saved);
}

}  // namespace oaslam::apps
