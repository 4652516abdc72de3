#include "oaslam/service/map_shelf.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <latch>
#include <set>
#include <thread>

#include "expect_input_error.h"
#include "random_map.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using testing::Eq;
using testing::ThrowsMessage;

constexpr std::chrono::seconds kAtMost{60};  // only reached where what must happen does not

// A folder of maps that counts what is opened.
class CountingStore : public MapStore {
 public:
  explicit CountingStore(const std::string& folder) : store_(OpenMapStore(folder)) {}

  std::optional<MapFile> Open(const std::string& map) override {
    ++opened;
    if (before_opening) before_opening(map);
    return store_->Open(map);
  }
  std::vector<StoredMap> Maps() override { return store_->Maps(); }
  std::optional<StoredMap> Find(const std::string& map) override { return store_->Find(map); }
  StoredMap Put(const std::string& map, const fs::path& file) override {
    return store_->Put(map, file);
  }
  bool Remove(const std::string& map) override { return store_->Remove(map); }
  AnchorEdits AnchorsSince(const std::string& map, int64_t version) override {
    return store_->AnchorsSince(map, version);
  }
  std::optional<int64_t> EditAnchor(const std::string& map, const std::string& name,
                                    const std::optional<Anchor>& anchor, bool must_be_new,
                                    const std::string& replaces = {}) override {
    return store_->EditAnchor(map, name, anchor, must_be_new, replaces);
  }
  void Watch(std::function<void(const std::string& map)> changed) override {
    store_->Watch(std::move(changed));
  }
  void EndWatch() override { store_->EndWatch(); }

  std::atomic<int> opened = 0;
  std::function<void(const std::string& map)> before_opening;

 private:
  const std::unique_ptr<MapStore> store_;
};

Anchor ShelfFlag() { return {"flag", 1, KeyframeId(0), {}, {}, {0, 0, 0}}; }

class MapShelfTest : public testing::Test {
 protected:
  MapShelfTest() {
    for (const char* map : {"a", "b", "c"}) Put(map, 1);
    OpenShelf(size_t{1} << 30);
  }
  // The content of maps with the same seed is the same.
  std::string File(uint64_t seed) {
    Rng rng(seed);
    const std::string path = files_ / "made.map";
    SaveMap(path, RandomMap({}, rng));
    return path;
  }
  void Put(const std::string& map, uint64_t seed) { store_->Put(map, File(seed)); }
  void OpenShelf(size_t memory) {
    shelf_ = nullptr;
    shelf_ = std::make_unique<MapShelf>(store_, SlamConfig::Offline(), memory,
                                        [this](const std::string& m) {
                                          const std::scoped_lock lock(mutex_);
                                          changed_.insert(m);
                                          came_.notify_all();
                                        });
  }
  // Waits until the shelf has told that the map has changed.
  void WaitForChange(const std::string& map) {
    std::unique_lock lock(mutex_);
    EXPECT_TRUE(came_.wait_for(lock, kAtMost, [&] { return changed_.erase(map) > 0; }));
  }

  const TempFolder folder_, files_;
  const std::shared_ptr<CountingStore> store_ = std::make_shared<CountingStore>(folder_.path());
  std::mutex mutex_;
  std::condition_variable came_;
  std::set<std::string> changed_;
  std::unique_ptr<MapShelf> shelf_;  // last member: tells the others
};

TEST_F(MapShelfTest, MapsAreLoadedWhenTheyAreAskedFor) {
  EXPECT_EQ(shelf_->loaded(), 0u);
  EXPECT_EQ(shelf_->bytes(), 0u);
  const auto a = shelf_->Get("a");
  ASSERT_TRUE(a);
  EXPECT_EQ(a->stored, store_->Find("a"));
  EXPECT_EQ(a->saved().map.keyframes.size(), 7u);
  EXPECT_EQ(shelf_->Get("a"), a);
  EXPECT_EQ(store_->opened, 1);
  EXPECT_EQ(shelf_->loaded(), 1u);
  EXPECT_EQ(shelf_->bytes(), a->bytes);
  EXPECT_FALSE(shelf_->Get("none"));
  EXPECT_EQ(shelf_->loaded(), 1u);
  for (const char* name : {"", ".hidden", "../a", "a/b"})
    EXPECT_INPUT_ERROR(shelf_->Get(name), HasSubstr("the name of a map")) << name;
}

TEST_F(MapShelfTest, AMapInUseIsNotForgottenAndLoadedOnce) {
  const size_t bytes = shelf_->Get("a")->bytes;
  OpenShelf(bytes + bytes / 2);
  store_->opened = 0;
  auto a = shelf_->Get("a");
  const auto b = shelf_->Get("b");
  EXPECT_EQ(shelf_->loaded(), 2u);
  EXPECT_EQ(shelf_->bytes(), a->bytes + b->bytes);
  EXPECT_EQ(shelf_->Get("a"), a);
  EXPECT_EQ(store_->opened, 2);
  a = nullptr;
  EXPECT_TRUE(shelf_->Get("c"));
  EXPECT_EQ(shelf_->loaded(), 2u);  // b, which is in use, and c
  EXPECT_EQ(shelf_->Get("b"), b);
  EXPECT_EQ(store_->opened, 3);
}

TEST_F(MapShelfTest, WhereManyAskForAMapItIsLoadedOnce) {
  constexpr int kThreads = 4;
  std::latch asking(kThreads);
  store_->before_opening = [&](const std::string&) { asking.wait(); };
  std::vector<std::shared_ptr<const ServedMap>> got(kThreads);
  {
    std::vector<std::jthread> threads;
    for (auto& map : got)
      threads.emplace_back([&] {
        asking.count_down();
        map = shelf_->Get("a");
      });
  }
  EXPECT_EQ(store_->opened, 1);
  for (const auto& map : got) EXPECT_EQ(map, got[0]);
}

TEST_F(MapShelfTest, AMapThatIsLoadedDelaysNoOther) {
  std::latch opening(1), may_open(1);
  store_->before_opening = [&](const std::string& map) {
    if (map != "a") return;
    opening.count_down();
    may_open.wait();
  };
  std::jthread slow([&] { shelf_->Get("a"); });
  opening.wait();
  EXPECT_TRUE(shelf_->Get("b"));
  EXPECT_TRUE(shelf_->Get("b"));
  EXPECT_EQ(shelf_->loaded(), 1u);
  may_open.count_down();
}

TEST_F(MapShelfTest, ThoseUsedLeastLatelyAreForgotten) {
  OpenShelf(shelf_->Get("a")->bytes * 5 / 2);
  store_->opened = 0;
  const std::weak_ptr<const ServedMap> a = shelf_->Get("a");
  const size_t bytes = a.lock()->bytes;
  shelf_->Get("b");
  EXPECT_EQ(shelf_->loaded(), 2u);
  shelf_->Get("a");
  shelf_->Get("c");
  EXPECT_EQ(shelf_->loaded(), 2u);
  EXPECT_EQ(store_->opened, 3);
  EXPECT_EQ(shelf_->Get("a"), a.lock());
  EXPECT_TRUE(shelf_->Get("c"));
  EXPECT_EQ(store_->opened, 3);  // b was forgotten
  EXPECT_TRUE(shelf_->Get("b"));
  EXPECT_EQ(store_->opened, 4);
  EXPECT_TRUE(a.expired());  // and then a
  EXPECT_LE(shelf_->bytes(), bytes * 5 / 2);
}

TEST_F(MapShelfTest, AMapThatIsLargerThanTheMemoryIsRefused) {
  OpenShelf(shelf_->Get("a")->bytes - 1);
  EXPECT_THAT([&] { shelf_->Get("a"); },
              ThrowsMessage<BrokenMap>(HasSubstrs("map a: ", "--memory")));
  EXPECT_EQ(shelf_->loaded(), 0u);
}

TEST_F(MapShelfTest, AMapInUseOutlivesItsReplacementAndRemoval) {
  const auto first = shelf_->Get("a");
  Put("a", 2);
  WaitForChange("a");
  const auto second = shelf_->Get("a");
  EXPECT_NE(second->stored.digest, first->stored.digest);
  EXPECT_EQ(second->stored, store_->Find("a"));
  store_->Remove("a");
  WaitForChange("a");
  EXPECT_FALSE(shelf_->Get("a"));
  EXPECT_EQ(shelf_->loaded(), 0u);
  for (const auto& map : {first, second}) EXPECT_EQ(map->saved().map.keyframes.size(), 7u);
  Put("a", 1);
  EXPECT_EQ(shelf_->Get("a")->stored.digest, first->stored.digest);
}

TEST_F(MapShelfTest, ABrokenMapIsAnErrorUntilItIsRepaired) {
  const std::string whole = store_->Find("a")->digest;
  folder_.Write("d.map", folder_.Read("a.map").substr(0, 20'000));
  for (int attempt = 0; attempt < 2; ++attempt)
    EXPECT_THAT([&] { shelf_->Get("d"); },
                ThrowsMessage<BrokenMap>(Eq("map d: its file is damaged")));
  EXPECT_EQ(shelf_->loaded(), 0u);
  Put("d", 1);
  EXPECT_EQ(shelf_->Get("d")->stored.digest, whole);
}

TEST_F(MapShelfTest, ABrokenReplacementIsNotUsed) {
  const auto whole = shelf_->Get("a");
  fs::rename(files_.Write("broken", "no map"), folder_ / "a.map");
  WaitForChange("a");
  EXPECT_EQ(shelf_->Get("a"), whole);
  EXPECT_THROW(shelf_->Refresh("a"), BrokenMap);
  Put("a", 2);
  shelf_->Refresh("a");
  EXPECT_NE(shelf_->Get("a"), whole);
}

TEST_F(MapShelfTest, EditsAreThoseOfTheStore) {
  EXPECT_EQ(shelf_->Edits("a")->version, 0);
  const std::unique_ptr<MapStore> other_server = OpenMapStore(folder_.path());
  other_server->EditAnchor("a", "flag 1", ShelfFlag(), true);
  WaitForChange("a");
  const auto edits = shelf_->Edits("a");
  EXPECT_EQ(edits->version, 1);
  EXPECT_EQ(edits->anchors.at("flag 1").anchor, ShelfFlag());
  other_server->EditAnchor("a", "flag 1", std::nullopt, false);
  other_server->EditAnchor("a", "flag 2", ShelfFlag(), true);
  shelf_->Refresh("a");
  const auto later = shelf_->Edits("a");
  EXPECT_FALSE(later->anchors.at("flag 1").anchor);
  EXPECT_TRUE(later->anchors.at("flag 2").anchor);
  EXPECT_TRUE(edits->anchors.at("flag 1").anchor);  // what is in use stays
}

// Between two looks at the store the map was removed, with its anchors, and stored again.
TEST_F(MapShelfTest, AMapThatWasStoredAnewHasNoOldAnchors) {
  const auto map = shelf_->Get("a");
  store_->EditAnchor("a", "flag 1", ShelfFlag(), true);
  shelf_->Refresh("a");
  EXPECT_TRUE(shelf_->Edits("a")->anchors.contains("flag 1"));
  store_->Remove("a");
  Put("a", 1);
  shelf_->Refresh("a");
  EXPECT_EQ(shelf_->Get("a")->stored.digest, map->stored.digest);
  EXPECT_TRUE(shelf_->Edits("a")->anchors.empty());
}

TEST_F(MapShelfTest, WhatIsLoadedIsServedWhileTheStoreIsAway) {
  const auto a = shelf_->Get("a");
  fs::rename(folder_.path(), folder_.path() + "-away");
  EXPECT_EQ(shelf_->Get("a"), a);
  EXPECT_THROW(shelf_->Get("b"), StoreUnavailable);
  fs::rename(folder_.path() + "-away", folder_.path());
  EXPECT_TRUE(shelf_->Get("b"));
  EXPECT_EQ(shelf_->Get("a"), a);
}

TEST_F(MapShelfTest, ThreadsAskReplaceAndForgetAtTheSameTime) {
  OpenShelf(shelf_->Get("a")->bytes * 3 / 2);
  std::vector<std::jthread> threads;
  std::atomic<bool> ends = false;
  for (const char* map : {"a", "b", "c"})
    threads.emplace_back([this, &ends, map] {
      while (!ends)
        if (const auto served = shelf_->Get(map)) {
          EXPECT_EQ(served->stored.name, map);
          EXPECT_EQ(served->saved().map.keyframes.size(), 7u);
          shelf_->Edits(map);
        }
    });
  for (uint64_t i = 0; i < 10; ++i) {
    Put("b", 2 + i % 2);
    shelf_->Refresh("b");
    if (i % 3 == 0) store_->Remove("c");
    store_->EditAnchor("a", "flag", ShelfFlag(), false);
    Put("c", 2);
  }
  ends = true;
  threads.clear();
  shelf_->Get("a");  // forgets what was in use until now
  EXPECT_LE(shelf_->loaded(), 1u);
}

}  // namespace
}  // namespace oaslam
