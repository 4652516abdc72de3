#include "oaslam/fork.h"

#include <thread>
#include <utility>

#include "forked.h"
#include "matchers.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

struct Counted {
  ~Counted() { ++destroyed; }
  int& destroyed;
  int value = 3;
};

bool IsRefused(const ProcessBound<Counted>& object) {
  try {
    return object->value != 3;
  } catch (const ForkError&) {
    return true;
  }
}

TEST(ProcessBound, IsUsedAndDestroyedInItsProcessAlone) {
  int destroyed = 0;
  const auto make = [&] { return std::make_unique<Counted>(destroyed); };
  ProcessBound<Counted> object(make());
  EXPECT_FALSE(IsRefused(object));
  EXPECT_TRUE(HoldsInChild([&] {
    const bool is_refused = IsRefused(object);
    { const ProcessBound<Counted> moved(std::move(object)); }
    object = make();
    const bool is_own = !IsRefused(object);
    object = {};
    return is_refused && is_own && destroyed == 1;
  }));
  EXPECT_FALSE(IsRefused(object));
  object = make();
  EXPECT_EQ(destroyed, 1);
  object = {};
  EXPECT_EQ(destroyed, 2);
}

TEST(ProcessBound, IsOfNoGrandchildEither) {
  int destroyed = 0;
  const auto make = [&] { return std::make_unique<Counted>(destroyed); };
  const ProcessBound<Counted> object(make());
  EXPECT_TRUE(HoldsInChild([&] {
    const ProcessBound<Counted> of_child(make());
    return HoldsInChild([&] { return IsRefused(of_child) && IsRefused(object); }) &&
           !IsRefused(of_child);
  }));
}

// A thread that holds the log's lock at that moment does not exist in the child.
TEST(Log, SpeaksInTheChildOfAProcessWhoseThreadsSpeak) {
  SetLogSink([](LogLevel, const std::string&) {});
  std::jthread speaker([](const std::stop_token& stop) {
    while (!stop.stop_requested()) Log(LogLevel::kInfo, "");
  });
  const auto speak = [] {
    Log(LogLevel::kInfo, "");
    return true;
  };
  for (int i = 0; i < 50; ++i) ASSERT_TRUE(HoldsInChild(speak));
  speaker.request_stop();
  speaker.join();
  SetLogSink({});
}

}  // namespace
}  // namespace oaslam
