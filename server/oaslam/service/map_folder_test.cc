#include <SQLiteCpp/SQLiteCpp.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/service/map_store.h"
#include "oaslam/storage/map_lock.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> Names(MapStore& store) {
  std::vector<std::string> names;
  for (const StoredMap& map : store.Maps()) names.push_back(map.name);
  return names;
}

std::string ContentOf(const std::optional<MapFile>& file) {
  std::ostringstream content;
  content << std::ifstream(file->path, std::ios::binary).rdbuf();
  return content.str();
}

Anchor FolderFlag() { return {"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}}; }

struct MapFolderTest : FolderTest {};

TEST_F(MapFolderTest, MapsAreFoundByTheNamesOfFiles) {
  const TempFolder other;
  folder.Write("b.map", "1");
  folder.Write("c.oaslam", "22");
  folder.Write("a.oaslam/map.oaslam", "333");
  folder.Write("d.map", "first");
  folder.Write("d.oaslam", "second");
  folder.Write(".hidden.map", "");
  folder.Write("no\nname.map", "");
  folder.Write("e.txt", "");
  folder.Write("f.oaslam/other.map", "");
  fs::create_directory(folder / "g.map");
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  EXPECT_THAT(Names(*store), ElementsAre("a", "b", "c", "d"));
  EXPECT_EQ(store->Find("a")->bytes, 3u);
  EXPECT_EQ(ContentOf(store->Open("d")), "first");

  // Each is replaced where it is.
  const std::string file = other.Write("x", "new");
  store->Put("a", file);
  store->Put("c", file);
  store->Put("new", file);
  EXPECT_EQ(folder.Read("a.oaslam/map.oaslam"), "new");
  EXPECT_EQ(folder.Read("c.oaslam"), "new");
  EXPECT_EQ(folder.Read("new.map"), "new");
  EXPECT_EQ(other.Read("x"), "new");
  EXPECT_TRUE(store->Remove("d"));
  EXPECT_TRUE(store->Remove("a"));
  EXPECT_THAT(Names(*store), ElementsAre("b", "c", "new"));
}

TEST_F(MapFolderTest, LinksOutOfTheFolderAreNotFollowed) {
  const TempFolder other;
  other.Write("secret.map", "secret");
  other.Write("deep.oaslam/map.oaslam", "secret");
  folder.Write("real.map", "1");
  fs::create_symlink(other / "secret.map", folder / "out.map");
  fs::create_directory_symlink(other / "deep.oaslam", folder / "deep.oaslam");
  fs::create_symlink(folder / "missing.map", folder / "nowhere.map");
  fs::create_symlink("loop.map", folder / "loop.map");
  fs::create_symlink("real.map", folder / "alias.map");
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  EXPECT_THAT(Names(*store), ElementsAre("alias", "real"));
  for (const char* name : {"out", "deep", "nowhere", "loop"}) {
    EXPECT_FALSE(store->Find(name)) << name;
    EXPECT_FALSE(store->Open(name)) << name;
  }
  // A map that is stored under such a name replaces the link, not what it leads to.
  store->Put("out", folder / "real.map");
  EXPECT_EQ(ContentOf(store->Open("out")), "1");
  EXPECT_EQ(other.Read("secret.map"), "secret");
}

TEST_F(MapFolderTest, WhatOthersChangeIsNoticed) {
  folder.Write("desk.map", "old");
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  const StoredMap old = *store->Find("desk");
  std::mutex mutex;
  std::condition_variable came;
  std::vector<std::string> names;
  store->Watch([&](const std::string& map) {
    const std::scoped_lock lock(mutex);
    names.push_back(map);
    came.notify_all();
  });
  const auto wait_for = [&](const std::string& map) {
    std::unique_lock lock(mutex);
    const bool has_come = came.wait_for(lock, std::chrono::seconds(1), [&] {
      return std::ranges::find(names, map) != names.end();
    });
    names.clear();
    return has_come;
  };
  fs::rename(folder.Write("hidden.tmp", "new"), folder / "desk.map");
  EXPECT_TRUE(wait_for("desk"));
  EXPECT_NE(store->Find("desk")->digest, old.digest);
  folder.Write("attic.map", "another");
  EXPECT_TRUE(wait_for("attic"));
  fs::remove(folder / "desk.map");
  EXPECT_TRUE(wait_for("desk"));

  // The folder is away for a while, as where it is on another machine.
  fs::rename(folder.path(), folder.path() + "-away");
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  EXPECT_THROW(store->Maps(), StoreUnavailable);
  fs::rename(folder.path() + "-away", folder.path());
  EXPECT_TRUE(wait_for(""));
  EXPECT_THAT(Names(*store), ElementsAre("attic"));
}

// A command that edits the map has the folder's lock meanwhile.
TEST_F(MapFolderTest, ReplacingAMapWaitsForEditsOfIt) {
  const std::string file = folder.Write("other/x", "new");
  folder.Write("desk.map", "old");
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  for (const bool removes : {false, true}) {
    std::optional<MapLock> lock(folder / "desk.map");
    std::atomic<bool> is_done = false;
    std::jthread replacing([&] {
      removes ? static_cast<void>(store->Remove("desk"))
              : static_cast<void>(store->Put("desk", file));
      is_done = true;
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_FALSE(is_done);
    EXPECT_EQ(folder.Read("desk.map"), removes ? "new" : "old");
    lock.reset();
    replacing.join();
    EXPECT_EQ(folder.Read("desk.map"), removes ? "" : "new");
  }
}

// Two servers on one folder.
TEST_F(MapFolderTest, OfTwoProcessesThatEditNoneLosesAnEdit) {
  constexpr int kEdits = 40;
  const auto edit = [&](const std::string& prefix) {
    const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
    for (int i = 0; i < kEdits; ++i)
      store->EditAnchor("desk", prefix + std::to_string(i), FolderFlag(), true);
  };
  const pid_t child = fork();
  if (child == 0) {
    edit("a");
    _exit(0);
  }
  edit("b");
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_THAT(OpenMapFolder(folder.path())->AnchorsSince("desk", 0).entries, SizeIs(2 * kEdits));
}

TEST_F(MapFolderTest, LeftoversOfDeadProcessesAreRemoved) {
  folder.Write("desk.map", "1");
  const fs::path own = folder / ".oaslam-serve";
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  const std::optional<MapFile> kept = store->Open("desk");

  const pid_t child = fork();
  if (child == 0) {
    // As if it was killed: no destructor runs.
    const std::unique_ptr<MapStore> of_child = OpenMapFolder(folder.path());
    const std::optional<MapFile> open = of_child->Open("desk");
    _exit(open ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  ASSERT_EQ(status, 0);
  const auto folders = [&] {
    return std::count_if(fs::directory_iterator(own), fs::directory_iterator(),
                         [](const auto& entry) { return entry.is_directory(); });
  };
  EXPECT_EQ(folders(), 2);
  OpenMapFolder(folder.path());
  EXPECT_EQ(folders(), 1);
  EXPECT_EQ(ContentOf(kept), "1");
}

TEST_F(MapFolderTest, FoldersThatCannotBeUsedAreRefused) {
  EXPECT_INPUT_ERROR(OpenMapFolder(folder / "missing"),
                     HasSubstr("missing: is neither a folder nor a map file"));
  EXPECT_INPUT_ERROR(OpenMapFolder("/dev/null"), HasSubstr("null: is neither a folder nor"));
  EXPECT_INPUT_ERROR(OpenMapStore(folder.Write("film.mp4", "film")),
                     HasSubstr("film.mp4: is no map file"));
}

TEST_F(MapFolderTest, AFileIsServedAloneAndStaysAlone) {
  const TempFolder other;
  folder.Write("desk.db", "1");
  folder.Write("hall.map", "22");
  fs::create_symlink(folder / "desk.db", other / "link.map");
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder / "desk.db");
  EXPECT_THAT(Names(*store), ElementsAre("desk"));
  EXPECT_EQ(ContentOf(store->Open("desk")), "1");
  EXPECT_FALSE(store->Find("hall"));
  EXPECT_FALSE(store->Open("hall"));
  EXPECT_FALSE(store->Remove("hall"));
  const std::string file = other.Write("x", "new");
  for (const auto& put : {+[](MapStore&to, const std::string&) { to.CheckNew("new"); },
                          +[](MapStore&to, const std::string&from) { to.Put("new", from); }})
    EXPECT_INPUT_ERROR(put(*store, file), HasSubstr("the map \"desk\" alone is served"));
  // It is replaced where it is, also after it was removed.
  store->Put("desk", file);
  EXPECT_TRUE(store->Remove("desk"));
  EXPECT_TRUE(store->Maps().empty());
  store->Put("desk", file);
  EXPECT_EQ(folder.Read("desk.db"), "new");
  // Its anchors are those that it has when its folder is served.
  folder.Write("desk.map", "3");
  ASSERT_TRUE(store->EditAnchor("desk", "a", FolderFlag(), true));
  EXPECT_EQ(OpenMapFolder(folder.path())->AnchorsSince("desk", 0).entries.size(), 1u);
  // A link names the map, and what it points to is the file.
  EXPECT_EQ(ContentOf(OpenMapFolder(other / "link.map")->Open("link")), "new");
}

// What is wrong with the file of edits after these statements, or after its content is overwritten.
std::string ProblemOfEdits(const std::string& sql, const std::string& content = {}) {
  const TempFolder folder;
  {
    const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
    for (int i = 0; i < 100; ++i) store->EditAnchor("desk", std::to_string(i), FolderFlag(), false);
  }
  const std::string path = folder / "service.sqlite";
  if (!sql.empty()) SQLite::Database(path, SQLite::OPEN_READWRITE).exec(sql);
  if (!content.empty()) {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    for (int at : {0, 4096 + 8, 2 * 4096 + 1, 3 * 4096 + 1}) {
      if (at == 0 && content != "all") continue;
      file.seekp(at).write(std::string(40, 'x').data(), 40);
    }
  }
  const std::string problem =
      InputErrorOf([&] { OpenMapFolder(folder.path())->AnchorsSince("desk", 0); });
  EXPECT_THAT(problem, HasSubstr(fs::canonical(path).string() + ": "));
  return problem;
}

TEST_F(MapFolderTest, DamagedFilesOfEditsAreRefused) {
  EXPECT_THAT(ProblemOfEdits("PRAGMA user_version = 2"),
              HasSubstr("newer version (format 2, this one reads 1)"));
  EXPECT_THAT(ProblemOfEdits("PRAGMA application_id = 7"), HasSubstr("is no file of anchors"));
  EXPECT_THAT(ProblemOfEdits("DROP TABLE anchors"), HasSubstr("anchors"));
  EXPECT_THAT(ProblemOfEdits("UPDATE anchors SET size = 'large'"),
              HasSubstr("table anchors, column size: a value of another type"));
  EXPECT_THAT(ProblemOfEdits("UPDATE anchors SET cam_from_anchor_qw = 3.0"),
              HasSubstr("quaternion of length"));
  EXPECT_THAT(ProblemOfEdits("", "all"), HasSubstr("not a database"));
  ProblemOfEdits("", "pages");
}

// An older version stays readable: its file is kept, as this program wrote it.
TEST_F(MapFolderTest, ReadsTheEditsOfVersion1) {
  fs::copy(fs::path(OASLAM_SOURCE_DIR) / "tests/data/service_format_1.sqlite",
           folder / "service.sqlite");
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  Anchor flag{"flag", 0.25, KeyframeId(7), {}, ObjectId(3), {0.5, -1, 2}};
  flag.cam_from_anchor = {Eigen::Quaterniond(0.8, 0, 0.6, 0), Eigen::Vector3d(1, 2, 3)};
  const AnchorEdits edits = store->AnchorsSince("desk", 0);
  EXPECT_EQ(edits.version, 4);
  ASSERT_EQ(edits.entries.size(), 2u);
  EXPECT_EQ(edits.entries[0].name, "a flag");
  EXPECT_EQ(edits.entries[0].anchor, flag);
  EXPECT_EQ(edits.entries[1].name, "gone");
  EXPECT_EQ(edits.entries[1].version, 3);
  EXPECT_FALSE(edits.entries[1].anchor);
  EXPECT_EQ(store->EditAnchor("desk", "another", flag, true), 5);
}

TEST_F(MapFolderTest, WaitsForOthersThatEdit) {
  const std::unique_ptr<MapStore> store = OpenMapFolder(folder.path());
  SQLite::Database other(folder / "service.sqlite", SQLite::OPEN_READWRITE);
  other.exec("BEGIN IMMEDIATE");
  std::thread ends_soon([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    other.exec("COMMIT");
  });
  EXPECT_EQ(store->EditAnchor("desk", "a", FolderFlag(), true), 1);
  ends_soon.join();
}

}  // namespace
}  // namespace oaslam
