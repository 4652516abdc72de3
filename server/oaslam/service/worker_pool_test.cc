#include "oaslam/service/worker_pool.h"

#include <latch>
#include <numeric>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "matchers.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

TEST(WorkerPool, FinishesWhatItWasGivenAndTakesNoMore) {
  WorkerPool pool(1, 2);
  std::latch begun(1), may_end(1);
  int done = 0;
  ASSERT_TRUE(pool.TryAdd([&] {
    begun.count_down();
    may_end.wait();
    ++done;
  }));
  begun.wait();
  ASSERT_TRUE(pool.TryAdd([&] { ++done; }));
  ASSERT_TRUE(pool.TryAdd([&] { ++done; }));
  EXPECT_FALSE(pool.TryAdd([&] { ++done; })) << "two wait already";
  const std::jthread other([&] { may_end.count_down(); });
  pool.Finish();
  EXPECT_EQ(done, 3);
  EXPECT_FALSE(pool.TryAdd([&] { ++done; }));
  pool.Finish();
  EXPECT_EQ(done, 3);
}

TEST(WorkerPool, ATaskThatThrowsEndsAlone) {
  std::vector<std::string> warnings;
  SetLogSink([&](LogLevel, const std::string& message) { warnings.push_back(message); });
  int done = 0;
  {
    WorkerPool pool(1, 10);
    ASSERT_TRUE(pool.TryAdd([] { throw std::runtime_error("no memory"); }));
    ASSERT_TRUE(pool.TryAdd([&] { ++done; }));
  }
  SetLogSink({});
  EXPECT_EQ(done, 1);
  EXPECT_THAT(warnings, ElementsAre(HasSubstr("no memory")));
}

TEST(WorkerPool, OneThreadKeepsTheOrderSeveralWorkAtATime) {
  std::vector<int> order;
  {
    WorkerPool pool(1, 100);
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(pool.TryAdd([&order, i] { order.push_back(i); }));
  }
  std::vector<int> ascending(100);
  std::iota(ascending.begin(), ascending.end(), 0);
  EXPECT_EQ(order, ascending);

  WorkerPool pool(3, 10);
  EXPECT_EQ(pool.size(), 3u);
  std::latch all_at_once(3);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(pool.TryAdd([&] { all_at_once.arrive_and_wait(); }));
  all_at_once.wait();
  pool.Finish();
  EXPECT_EQ(pool.size(), 3u);
  EXPECT_EQ(pool.waiting(), 0u);
}

}  // namespace
}  // namespace oaslam
