#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "oaslam/service/edit_file.h"
#include "oaslam/service/map_files.h"
#include "oaslam/service/map_store.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// Between two looks at the folder: what others change is noticed within a second.
constexpr std::chrono::milliseconds kPeriod{300};

class MapFolder : public MapStore {
  // The files, and how often their anchors were edited, by map.
  struct State {
    std::map<std::string, FileIdentity> files;
    std::map<std::string, int64_t> edits;
    int64_t changes_of_edits = -1;
  };

  template <typename Act>
  auto Edit(Act act) {
    struct WakeAtEnd {
      MapFolder* folder;
      ~WakeAtEnd() { folder->Wake(); }
    } const wake{this};
    const std::scoped_lock lock(edits_mutex_);
    return act();
  }

 public:
  explicit MapFolder(const std::string& folder_or_file)
      : files_(folder_or_file),
        edits_path_(files_.folder() / "service.sqlite"),
        edits_(edits_path_) {}

  ~MapFolder() override { MapFolder::EndWatch(); }

  void EndWatch() override {
    {
      const std::scoped_lock lock(watch_mutex_);
      is_ending_ = true;
    }
    wake_.notify_all();
    if (watcher_.joinable()) watcher_.join();
  }

  std::vector<StoredMap> Maps() override { return files_.Maps(); }
  std::optional<StoredMap> Find(const std::string& map) override { return files_.Find(map); }
  std::optional<MapFile> Open(const std::string& map) override { return files_.Open(map); }

  void CheckNew(const std::string& map) override { files_.CheckNew(map); }

  StoredMap Put(const std::string& map, const std::filesystem::path& file) override {
    const bool is_new = !files_.Find(map);
    const StoredMap stored = files_.Put(map, file);
    Edit([&] {
      if (!is_new) edits_.NoteReplacedMap(map);
    });
    return stored;
  }

  bool Remove(const std::string& map) override {
    if (!files_.Remove(map)) return false;
    Edit([&] { edits_.RemoveMap(map); });
    return true;
  }

  AnchorEdits AnchorsSince(const std::string& map, int64_t version) override {
    const std::scoped_lock lock(edits_mutex_);
    return edits_.AnchorsSince(map, version);
  }

  std::optional<int64_t> EditAnchor(const std::string& map, const std::string& name,
                                    const std::optional<Anchor>& anchor, bool must_be_new,
                                    const std::string& replaces) override {
    return Edit([&] { return edits_.EditAnchor(map, name, anchor, must_be_new, replaces); });
  }

  void Watch(std::function<void(const std::string& map)> changed) override {
    OASLAM_CHECK(!watcher_.joinable());
    // What changes from here on is noticed.
    auto edits = std::make_shared<EditFile>(edits_path_);
    State state = Look(*edits, {});
    watcher_ =
        std::thread([this, edits, state = std::move(state),
                     changed = std::move(changed)]() mutable { Follow(*edits, state, changed); });
  }

 private:
  void Wake() {
    {
      const std::scoped_lock lock(watch_mutex_);
      is_woken_ = true;
    }
    wake_.notify_all();
  }

  // Brings a state up to date.
  State Look(EditFile& edits, State state) {
    state.files = files_.Identities();
    const int64_t changes = edits.ChangesByOthers();
    if (std::exchange(state.changes_of_edits, changes) != changes) state.edits = edits.Versions();
    return state;
  }

  void Follow(EditFile& edits, State state,
              const std::function<void(const std::string& map)>& changed) {
    bool was_reached = true;
    for (;;) {
      {
        std::unique_lock lock(watch_mutex_);
        wake_.wait_for(lock, kPeriod, [this] { return is_ending_ || is_woken_; });
        if (is_ending_) return;
        is_woken_ = false;
      }
      try {
        const State before = std::exchange(state, Look(edits, state));
        if (!std::exchange(was_reached, true)) {
          changed("");
          continue;
        }
        for (const std::string& map : Changed(before, state)) changed(map);
      } catch (const std::runtime_error&) {
        was_reached = false;  // The calls of others tell why.
      }
    }
  }

  static std::set<std::string> Changed(const State& before, const State& now) {
    std::set<std::string> maps;
    const auto compare = [&](const auto& a, const auto& b) {
      for (const auto& [map, value] : a)
        if (const auto other = b.find(map); other == b.end() || other->second != value)
          maps.insert(map);
    };
    compare(before.files, now.files);
    compare(now.files, before.files);
    compare(now.edits, before.edits);
    return maps;
  }

  MapFiles files_;
  const std::string edits_path_;
  std::mutex edits_mutex_;
  EditFile edits_;

  std::mutex watch_mutex_;
  std::condition_variable wake_;
  bool is_ending_ = false, is_woken_ = false;
  std::thread watcher_;
};

}  // namespace

std::unique_ptr<MapStore> OpenMapFolder(const std::string& folder_or_file) {
  return std::make_unique<MapFolder>(folder_or_file);
}

}  // namespace oaslam
