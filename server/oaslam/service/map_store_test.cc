#include "oaslam/service/map_store.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <set>
#include <sstream>
#include <thread>

#include "expect_input_error.h"
#include "postgres_server.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

// The names that a store has reported, with a wait for one.
class Reported {
 public:
  std::function<void(const std::string&)> Callback() {
    return [this](const std::string& map) {
      const std::scoped_lock lock(mutex_);
      names_.insert(map);
      added_.notify_all();
    };
  }
  // Forgets the name when it has come.
  bool Comes(const std::string& map, std::chrono::milliseconds within) {
    std::unique_lock lock(mutex_);
    return added_.wait_for(lock, within, [&] { return names_.erase(map) > 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable added_;
  std::set<std::string> names_;
};

constexpr std::chrono::milliseconds kSoon{1000}, kNotSoon{700};

Anchor StoreFlag(double size = 0.25) {
  Anchor anchor{"flag", size, KeyframeId(7), {}, ObjectId(3), {0.1, -2e-17, 1e300}};
  anchor.cam_from_anchor.rotation = Eigen::Quaterniond(1, 2, -3, 4).normalized();
  anchor.cam_from_anchor.translation = {1.0 / 3, -0.0, 12345.678901234567};
  return anchor;
}

PostgresServer* SharedServer() {
  static const std::unique_ptr<PostgresServer> server =
      PostgresServer::Programs().empty() ? nullptr : std::make_unique<PostgresServer>();
  return server.get();
}

std::string NewDatabase() {
  if (!SharedServer()) return {};
  static int number = 0;
  const std::string name = "maps" + std::to_string(number++);
  SharedServer()->Run("CREATE DATABASE " + name);
  return SharedServer()->Uri(name);
}

class MapStoreTest : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "Folder") {
      maps_ = std::make_unique<TempFolder>();
      location_ = maps_->path();
    } else {
      location_ = NewDatabase();
      if (location_.empty()) GTEST_SKIP() << "PostgreSQL is not installed";
    }
    store_ = OpenMapStore(location_);
  }
  std::unique_ptr<MapStore> Another() const { return OpenMapStore(location_); }

  // A file to store.
  std::string File(const std::string& content) { return other_.Write("a file", content); }
  static std::string ContentOf(const MapFile& file) {
    std::ostringstream content;
    content << std::ifstream(file.path, std::ios::binary).rdbuf();
    return content.str();
  }

  TempFolder other_;
  std::unique_ptr<TempFolder> maps_;
  std::string location_;
  std::unique_ptr<MapStore> store_;
};

TEST_P(MapStoreTest, StoresFindsAndOpens) {
  EXPECT_TRUE(store_->Maps().empty());
  EXPECT_FALSE(store_->Find("desk"));
  EXPECT_FALSE(store_->Open("desk"));
  const StoredMap desk = store_->Put("desk", File("abc"));
  // The example of FIPS 180-4.
  EXPECT_EQ(desk.digest, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(desk.name, "desk");
  EXPECT_EQ(desk.bytes, 3u);
  EXPECT_NEAR(desk.changed, static_cast<double>(time(nullptr)), 5);
  const StoredMap empty = store_->Put("Attic-2.b_c", File(""));
  EXPECT_THAT(store_->Maps(), ElementsAre(empty, desk));
  EXPECT_EQ(Another()->Find("desk"), desk);
  const std::optional<MapFile> file = Another()->Open("desk");
  ASSERT_TRUE(file);
  EXPECT_EQ(file->map, desk);
  EXPECT_EQ(ContentOf(*file), "abc");
  EXPECT_EQ(ContentOf(*store_->Open("Attic-2.b_c")), "");
  EXPECT_INPUT_ERROR(store_->Put("desk", other_ / "missing"), HasSubstr("missing: cannot be read"));
  EXPECT_EQ(store_->Find("desk"), desk);
}

TEST_P(MapStoreTest, KeepsLargeFiles) {
  std::string content(5'000'001, '\0');
  for (size_t i = 0; i < content.size(); ++i) content[i] = static_cast<char>((i * i) >> 7);
  const StoredMap stored = store_->Put("large", File(content));
  EXPECT_EQ(stored.bytes, content.size());
  const std::optional<MapFile> file = store_->Open("large");
  EXPECT_EQ(file->map, stored);
  EXPECT_TRUE(ContentOf(*file) == content);
}

TEST_P(MapStoreTest, AnOpenMapStaysWhileItIsReplacedAndRemoved) {
  store_->Put("desk", File("old"));
  std::optional<MapFile> old = store_->Open("desk");
  const StoredMap replaced = Another()->Put("desk", File("new one"));
  EXPECT_EQ(store_->Find("desk"), replaced);
  const std::optional<MapFile> now = store_->Open("desk");
  EXPECT_EQ(ContentOf(*now), "new one");
  EXPECT_EQ(now->map, replaced);
  EXPECT_TRUE(store_->Remove("desk"));
  EXPECT_FALSE(store_->Remove("desk"));
  EXPECT_FALSE(store_->Find("desk"));
  EXPECT_FALSE(Another()->Open("desk"));
  EXPECT_EQ(ContentOf(*old), "old");
  EXPECT_EQ(ContentOf(*now), "new one");
  const std::filesystem::path path = old->path;
  store_.reset();
  EXPECT_EQ(ContentOf(*old), "old");
  old.reset();
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST_P(MapStoreTest, ReadersHaveTheOldMapOrTheNewOne) {
  const std::string contents[] = {std::string(3'000'000, 'a'), std::string(2'000'000, 'b')};
  store_->Put("desk", File(contents[0]));
  std::atomic<bool> is_done = false;
  std::atomic<int> read = 0;
  std::thread reader([&] {
    const std::unique_ptr<MapStore> another = Another();
    while (!is_done || read < 5) {
      const std::optional<MapFile> file = another->Open("desk");
      ASSERT_TRUE(file);
      const std::string content = ContentOf(*file);
      ASSERT_TRUE(content == contents[0] || content == contents[1]);
      ASSERT_EQ(file->map.bytes, content.size());
      ++read;
    }
  });
  for (int i = 0; i < 10; ++i) {
    const std::string file = File(contents[(i + 1) % 2]);
    store_->Put("desk", file);
  }
  is_done = true;
  reader.join();
}

TEST_P(MapStoreTest, OfTwoThatStoreAMapAtOnceOneWins) {
  const std::string files[] = {other_.Write("a", std::string(2'500'000, 'a')),
                               other_.Write("b", std::string(1'500'000, 'b'))};
  for (int round = 0; round < 5; ++round) {
    std::thread a([&] { store_->Put("desk", files[0]); });
    Another()->Put("desk", files[1]);
    a.join();
    const std::optional<MapFile> file = store_->Open("desk");
    ASSERT_TRUE(file);
    EXPECT_EQ(file->map, store_->Find("desk"));
    EXPECT_EQ(std::filesystem::file_size(file->path), file->map.bytes);
    store_->Remove("desk");
  }
}

TEST_P(MapStoreTest, AnchorsComeBackAsTheyWere) {
  const AnchorEdits none = store_->AnchorsSince("desk", 0);
  EXPECT_EQ(none.version, 0);
  EXPECT_TRUE(none.entries.empty());
  Anchor free = StoreFlag();
  free.object = ObjectId();
  const std::string odd = "it's \"ünï\" \\ $1 -- ; é";
  EXPECT_EQ(store_->EditAnchor("desk", "a flag", StoreFlag(), false), 1);
  EXPECT_EQ(store_->EditAnchor("desk", odd, free, true), 2);
  const AnchorEdits edits = Another()->AnchorsSince("desk", 0);
  EXPECT_EQ(edits.version, 2);
  ASSERT_EQ(edits.entries.size(), 2u);
  EXPECT_EQ(edits.entries[0].name, "a flag");
  EXPECT_EQ(edits.entries[0].version, 1);
  EXPECT_EQ(edits.entries[0].anchor, StoreFlag());
  EXPECT_EQ(edits.entries[1].name, odd);
  EXPECT_EQ(edits.entries[1].anchor, free);
  EXPECT_EQ(store_->AnchorsSince("other", 0).version, 0);
}

TEST_P(MapStoreTest, TheLaterEditWinsAndSinceTellsIt) {
  const std::unique_ptr<MapStore> another = Another();
  store_->EditAnchor("desk", "a", StoreFlag(1), true);
  another->EditAnchor("desk", "b", StoreFlag(2), true);
  EXPECT_EQ(store_->EditAnchor("desk", "a", StoreFlag(3), true), std::nullopt);
  const int64_t version = *another->EditAnchor("desk", "a", StoreFlag(4), false);
  EXPECT_EQ(version, store_->AnchorsSince("desk", 0).version);
  AnchorEdits edits = store_->AnchorsSince("desk", version - 1);
  ASSERT_EQ(edits.entries.size(), 1u);
  EXPECT_EQ(edits.entries[0].anchor, StoreFlag(4));
  EXPECT_TRUE(store_->AnchorsSince("desk", version).entries.empty());

  EXPECT_EQ(store_->EditAnchor("desk", "b", std::nullopt, false), version + 1);
  edits = another->AnchorsSince("desk", version);
  ASSERT_EQ(edits.entries.size(), 1u);
  EXPECT_EQ(edits.entries[0].name, "b");
  EXPECT_EQ(edits.entries[0].anchor, std::nullopt);
  EXPECT_EQ(store_->AnchorsSince("desk", 0).entries.size(), 2u);
  // A name of what was removed is free.
  EXPECT_EQ(store_->EditAnchor("desk", "b", StoreFlag(5), true), version + 2);
}

// Nobody sees both names, or neither.
TEST_P(MapStoreTest, ARenameIsOneEdit) {
  store_->EditAnchor("desk", "a", StoreFlag(1), true);
  EXPECT_EQ(store_->EditAnchor("desk", "b", StoreFlag(1), true, "a"), 2);
  const AnchorEdits edits = Another()->AnchorsSince("desk", 0);
  EXPECT_EQ(edits.version, 2);
  ASSERT_EQ(edits.entries.size(), 2u);
  for (const AnchorEntry& entry : edits.entries) {
    EXPECT_EQ(entry.version, 2);
    EXPECT_EQ(entry.anchor.has_value(), entry.name == "b");
  }
  store_->EditAnchor("desk", "c", StoreFlag(2), true);
  EXPECT_EQ(store_->EditAnchor("desk", "c", StoreFlag(1), true, "b"), std::nullopt);
  EXPECT_EQ(store_->AnchorsSince("desk", 0).version, 3);
  for (const AnchorEntry& entry : store_->AnchorsSince("desk", 0).entries)
    EXPECT_EQ(entry.anchor.has_value(), entry.name != "a");
}

TEST_P(MapStoreTest, OneOfManyGetsANewName) {
  constexpr int kThreads = 8, kNames = 10;
  std::vector<std::unique_ptr<MapStore>> stores;
  for (int i = 0; i < 2; ++i) stores.push_back(Another());
  std::atomic<int> placed = 0;
  std::mutex mutex;
  std::set<int64_t> versions;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (int n = 0; n < kNames; ++n) {
        const auto version =
            stores[t % 2]->EditAnchor("desk", "name " + std::to_string(n), StoreFlag(t + 1), true);
        if (!version) continue;
        ++placed;
        const std::scoped_lock lock(mutex);
        EXPECT_TRUE(versions.insert(*version).second);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(placed, kNames);
  const AnchorEdits edits = store_->AnchorsSince("desk", 0);
  EXPECT_EQ(edits.entries.size(), size_t{kNames});
  EXPECT_EQ(edits.version, *versions.rbegin());
}

TEST_P(MapStoreTest, EachEditOfManyIsAVersion) {
  constexpr int kThreads = 6, kEdits = 20;
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < kEdits; ++i)
        store_->EditAnchor("desk", "one", StoreFlag(1 + t * kEdits + i), false);
    });
  for (std::thread& thread : threads) thread.join();
  const AnchorEdits edits = store_->AnchorsSince("desk", 0);
  EXPECT_EQ(edits.version, kThreads * kEdits);
  ASSERT_EQ(edits.entries.size(), 1u);
  EXPECT_EQ(edits.entries[0].version, edits.version);
}

TEST_P(MapStoreTest, ARemovedMapTakesItsAnchorsAlongButNoVersionComesTwice) {
  store_->Put("desk", File("1"));
  store_->EditAnchor("desk", "a", StoreFlag(), true);
  store_->EditAnchor("attic", "a", StoreFlag(), true);
  const int64_t before = store_->AnchorsSince("desk", 0).version;
  ASSERT_TRUE(store_->Remove("desk"));
  EXPECT_TRUE(store_->AnchorsSince("desk", 0).entries.empty());
  EXPECT_EQ(store_->AnchorsSince("attic", 0).entries.size(), 1u);
  store_->Put("desk", File("2"));
  EXPECT_GT(*store_->EditAnchor("desk", "b", StoreFlag(), true), before);
}

TEST_P(MapStoreTest, ThatAMapIsReplacedOrRemovedIsAnEditOfItsAnchors) {
  const auto edits = [&] { return Another()->AnchorsSince("desk", 0); };
  store_->Put("desk", File("1"));
  EXPECT_EQ(edits().version, 0);
  store_->EditAnchor("desk", "a", StoreFlag(), true);
  EXPECT_EQ(edits().map_version, 0);
  store_->Put("desk", File("2"));
  EXPECT_EQ(edits().version, 2);
  EXPECT_EQ(edits().map_version, 2);
  EXPECT_EQ(edits().entries.size(), 1u);  // it stays
  store_->EditAnchor("desk", "a", StoreFlag(2), false);
  EXPECT_EQ(edits().map_version, 2);
  store_->Remove("desk");
  store_->Put("desk", File("2"));
  store_->EditAnchor("desk", "b", StoreFlag(), true);
  EXPECT_EQ(edits().map_version, 4);
  EXPECT_EQ(edits().version, 5);
  EXPECT_EQ(edits().entries.size(), 1u);
}

TEST_P(MapStoreTest, ChangesAreReportedToAll) {
  const std::unique_ptr<MapStore> another = Another();
  Reported here, there;
  store_->Watch(here.Callback());
  another->Watch(there.Callback());
  const auto is_reported = [&] {
    const bool at_one = here.Comes("desk", kSoon), at_other = there.Comes("desk", kSoon);
    return at_one && at_other;
  };
  store_->Put("desk", File("1"));
  EXPECT_TRUE(is_reported());
  another->EditAnchor("desk", "a", StoreFlag(), true);
  EXPECT_TRUE(is_reported());
  EXPECT_FALSE(here.Comes("desk", kNotSoon));
  store_->EditAnchor("desk", "a", std::nullopt, false);
  EXPECT_TRUE(is_reported());
  another->Put("desk", File("2"));
  EXPECT_TRUE(is_reported());
  another->Remove("desk");
  EXPECT_TRUE(is_reported());
  EXPECT_FALSE(there.Comes("attic", std::chrono::milliseconds(0)));
}

TEST_P(MapStoreTest, NamesHaveWhatPeopleWrite) {
  for (const std::string name : {"a b", "a'b\"", "a;b&c", "a:b", "Küche",
                                 "Ku\xCC\x88"
                                 "che",
                                 "日本", "-dash", "%s%d", "#hash"}) {
    store_->Put(name, File("1"));
    EXPECT_EQ(store_->Find(name)->name, name);
    store_->EditAnchor(name, "a", StoreFlag(), true);
    EXPECT_EQ(store_->AnchorsSince(name, 0).entries.size(), 1u) << name;
    EXPECT_TRUE(store_->Remove(name)) << name;
  }
}

TEST_P(MapStoreTest, NamesThatCannotBeAreRefused) {
  for (const std::string& name :
       {std::string(), std::string(".hidden"), std::string("a/b"), std::string("../a"),
        std::string("a\nb"), std::string("\xC3("), std::string("a\0b", 3), std::string(201, 'a')}) {
    const auto expect = [&](const std::function<void()>& act) {
      EXPECT_THAT(InputErrorOf(act), HasSubstr("the name of a map has 1 to 200")) << name;
    };
    expect([&] { store_->Find(name); });
    expect([&] { store_->Open(name); });
    expect([&] { store_->Put(name, File("")); });
    expect([&] { store_->Remove(name); });
    expect([&] { store_->AnchorsSince(name, 0); });
    expect([&] { store_->EditAnchor(name, "a", StoreFlag(), false); });
  }
  CheckMapName(std::string(200, 'a'));
  for (const std::string& name : {std::string(), std::string(65, 'a'), std::string("a\nb"),
                                  std::string("a\0b", 3), std::string("\xC3(")})
    EXPECT_INPUT_ERROR(store_->EditAnchor("desk", name, StoreFlag(), false),
                       HasSubstr("the name of an anchor has 1 to 64"));
  Anchor endless = StoreFlag(INFINITY);
  EXPECT_INPUT_ERROR(store_->EditAnchor("desk", "a", endless, false), HasSubstr("must be finite"));
  EXPECT_EQ(store_->AnchorsSince("desk", 0).version, 0);
}

INSTANTIATE_TEST_SUITE_P(Of, MapStoreTest, ::testing::Values("Folder", "Database"),
                         [](const auto& kind) { return kind.param; });

}  // namespace
}  // namespace oaslam
