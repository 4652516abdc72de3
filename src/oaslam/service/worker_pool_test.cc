#include "oaslam/service/worker_pool.h"

#include <gtest/gtest.h>

#include <latch>
#include <thread>

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

}  // namespace
}  // namespace oaslam
