#include "oaslam/util/log.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include "matchers.h"

namespace oaslam {
namespace {

// Constructed before any sink and destroyed after all, as a static Slam of an application may be.
struct LastOfAll {
  ~LastOfAll() {
    if (speaks) Log(LogLevel::kInfo, "the end");
  }
  bool speaks = false;
} last_of_all;

TEST(Log, ASinkLivesAsLongAsTheProgram) {
  const auto end = [] {
    SetLogSink([kept = std::string(100, 'x')](LogLevel, const std::string& message) {
      fmt::print(stderr, "{} {}\n", kept, message);
    });
    last_of_all.speaks = true;
    std::exit(0);
  };
  EXPECT_EXIT(end(), testing::ExitedWithCode(0), "x{100} the end");
}

TEST(Log, ASinkMayReplaceItselfAndCauseMessages) {
  std::vector<std::string> told;
  const auto kept = std::make_shared<std::string>("first: ");
  SetLogSink([&told, kept](LogLevel, const std::string& message) {
    SetLogSink([&told](LogLevel, const std::string& later) { told.push_back("second: " + later); });
    Log(LogLevel::kInfo, "from within");
    told.push_back(*kept + message);  // what the sink has captured is still there
  });
  EXPECT_EQ(kept.use_count(), 2);
  Log(LogLevel::kInfo, "a");
  EXPECT_EQ(kept.use_count(), 1);
  Log(LogLevel::kInfo, "b");
  SetLogSink({});
  Log(LogLevel::kInfo, "c");
  EXPECT_THAT(told, ElementsAre("second: from within", "first: a", "second: b"));
}

// A sink that waited for another would deadlock with a thread that logs while it holds a lock which
// the sink takes.
TEST(Log, NoSinkWaitsForAnother) {
  std::promise<void> first, second;
  SetLogSink([&](LogLevel, const std::string& message) {
    if (message == "second") return second.set_value();
    first.set_value();
    EXPECT_EQ(second.get_future().wait_for(std::chrono::seconds(60)), std::future_status::ready);
  });
  std::jthread other([] { Log(LogLevel::kInfo, "first"); });
  first.get_future().wait();  // the sink is at work there
  Log(LogLevel::kInfo, "second");
  other.join();
  SetLogSink({});
}

}  // namespace
}  // namespace oaslam
