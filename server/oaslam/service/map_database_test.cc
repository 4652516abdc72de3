#include <signal.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <fstream>
#include <memory>
#include <thread>

#include "expect_input_error.h"
#include "oaslam/service/map_store.h"
#include "postgres_server.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

using Clock = std::chrono::steady_clock;

Anchor Flag(double size = 1) { return {"flag", size, KeyframeId(0), {}, {}, {0, 0, 0}}; }

double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

template <typename Condition>
bool BecomesTrue(Condition condition, double seconds) {
  const auto start = Clock::now();
  while (!condition()) {
    if (SecondsSince(start) > seconds) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

class MapDatabaseTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (PostgresServer::Programs().empty()) GTEST_SKIP() << "PostgreSQL is not installed";
    server_ = std::make_unique<PostgresServer>();
  }
  std::string Uri() const { return server_->Uri("postgres"); }
  std::unique_ptr<PostgresServer> server_;
};

TEST_F(MapDatabaseTest, OutlivesABrokenConnectionAndARestart) {
  const TempFolder folder;
  const std::unique_ptr<MapStore> store = OpenMapDatabase(Uri());
  store->Put("desk", folder.Write("a", "content"));
  ASSERT_EQ(store->EditAnchor("desk", "a", Flag(), true), 1);
  const std::optional<MapFile> open = store->Open("desk");
  std::atomic<int> times_unknown = 0, times_desk = 0;
  store->Watch([&](const std::string& map) { ++(map.empty() ? times_unknown : times_desk); });

  for (int round = 0; round < 2; ++round) {
    server_->Stop();
    for (int call = 0; call < 5; ++call) {
      const auto start = Clock::now();
      EXPECT_THROW(store->Maps(), StoreUnavailable);
      EXPECT_THROW(store->EditAnchor("desk", "b", Flag(), false), StoreUnavailable);
      EXPECT_THROW(store->Open("desk"), StoreUnavailable);
      EXPECT_LT(SecondsSince(start), 1);
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    EXPECT_TRUE(std::filesystem::exists(open->path));
    EXPECT_EQ(times_unknown, round);
    server_->Start();
    EXPECT_TRUE(BecomesTrue([&] { return times_unknown == round + 1; }, 4));
    // What was stored is there, and edits are reported as before.
    EXPECT_EQ(store->Find("desk"), open->map);
    times_desk = 0;
    EXPECT_EQ(store->EditAnchor("desk", "a", Flag(2), false), 2 + round);
    EXPECT_TRUE(BecomesTrue([&] { return times_desk == 1; }, 1));
  }
  EXPECT_EQ(store->AnchorsSince("desk", 0).entries.size(), 1u);
}

TEST_F(MapDatabaseTest, ADatabaseThatDoesNotAnswerIsNotWaitedForLong) {
  const std::unique_ptr<MapStore> store = OpenMapDatabase(Uri());
  ASSERT_EQ(store->EditAnchor("desk", "a", Flag(), true), 1);
  std::atomic<bool> was_unknown = false;
  store->Watch([&](const std::string& map) { was_unknown = was_unknown || map.empty(); });
  server_->Freeze();
  for (int call = 0; call < 2; ++call) {
    const auto start = Clock::now();
    EXPECT_THROW(store->EditAnchor("desk", "b", Flag(), false), StoreUnavailable);
    EXPECT_LT(SecondsSince(start), 7);
  }
  std::this_thread::sleep_for(std::chrono::seconds(5));
  server_->GoOn();
  EXPECT_TRUE(BecomesTrue([&] { return was_unknown.load(); }, 10));
  EXPECT_EQ(store->AnchorsSince("desk", 0).entries.front().name, "a");
}

TEST_F(MapDatabaseTest, ABrokenTransferLeavesTheOldMap) {
  const TempFolder folder;
  const std::unique_ptr<MapStore> store = OpenMapDatabase(Uri());
  store->Put("desk", folder.Write("a", "old"));
  signal(SIGPIPE, SIG_IGN);
  // A file that has no end until the server is gone.
  const std::string endless = folder / "endless";
  ASSERT_EQ(mkfifo(endless.c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream out(endless, std::ios::binary);
    const std::string part(100'000, 'x');
    for (int i = 0; i < 50; ++i) out << part;
    out.flush();
    server_->Stop();
    server_->Start();
    for (int i = 0; i < 50; ++i) out << part;
  });
  EXPECT_THROW(store->Put("desk", endless), StoreUnavailable);
  writer.join();
  EXPECT_EQ(store->Find("desk")->bytes, 3u);
  EXPECT_EQ(store->Open("desk")->map.bytes, 3u);
}

TEST_F(MapDatabaseTest, ASlowTransferDoesNotDelayEdits) {
  const TempFolder folder;
  const std::unique_ptr<MapStore> store = OpenMapDatabase(Uri());
  const std::string slow = folder / "slow";
  ASSERT_EQ(mkfifo(slow.c_str(), 0600), 0);
  std::atomic<bool> is_stored = false;
  std::thread transfer([&] {
    store->Put("desk", slow);
    is_stored = true;
  });
  {
    std::ofstream out(slow, std::ios::binary);
    out << std::string(3'000'000, 'x') << std::flush;
    const auto start = Clock::now();
    for (int i = 0; i < 10; ++i) store->EditAnchor("desk", "a", Flag(), false);
    EXPECT_LT(SecondsSince(start), 2);
    EXPECT_FALSE(is_stored);
    EXPECT_FALSE(store->Find("desk"));
  }
  transfer.join();
  EXPECT_EQ(store->Open("desk")->map.bytes, 3'000'000u);
}

TEST_F(MapDatabaseTest, DamagedContentIsRefused) {
  const TempFolder folder;
  const std::unique_ptr<MapStore> store = OpenMapDatabase(Uri());
  store->Put("desk", folder.Write("a", "content"));
  server_->Run("UPDATE oaslam_chunks SET data = 'contend'");
  EXPECT_INPUT_ERROR(store->Open("desk"), HasSubstr("the content of map \"desk\" is damaged"));
}

TEST_F(MapDatabaseTest, ServersMayStartAtOnceAndNewerTablesAreRefused) {
  std::vector<std::thread> servers;
  for (int i = 0; i < 4; ++i)
    servers.emplace_back([&] { EXPECT_TRUE(OpenMapDatabase(Uri())->Maps().empty()); });
  for (std::thread& thread : servers) thread.join();
  server_->Run("UPDATE oaslam_format SET version = 2");
  EXPECT_INPUT_ERROR(OpenMapDatabase(Uri()),
                     HasSubstr("newer version (format 2, this one reads 1)"));
}

TEST(MapDatabase, MessagesDoNotShowThePassword) {
  const TempFolder folder;
  for (const std::string& uri :
       {"postgresql://me:a-secret@/maps?host=" + folder.path(),
        std::string("postgres://me:a-secret@127.0.0.1:1/maps"),
        std::string("postgresql://me:a-secret%zz@/maps"),
        std::string("postgresql://me:a-secret@/maps?no_such_option=a-secret"),
        std::string("postgresql://me:x@/a-secret?password=a-secret&host=/nowhere"),
        std::string("postgresql://me@[a-secret")}) {
    const std::string message = InputErrorOf([&] { OpenMapStore(uri); });
    EXPECT_THAT(message, AllOf(HasSubstr("database: "), Not(HasSubstr("a-secret"))));
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
}

}  // namespace
}  // namespace oaslam
