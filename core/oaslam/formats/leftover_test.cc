#include "oaslam/formats/leftover.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <deque>
#include <filesystem>
#include <fstream>

namespace oaslam {
namespace {

namespace fs = std::filesystem;

class LeftoverTest : public testing::Test {
 protected:
  LeftoverTest() { fs::create_directories(folder_); }
  ~LeftoverTest() override { fs::remove_all(folder_); }
  std::string File(const std::string& name) const {
    std::ofstream(folder_ / name) << "x";
    return (folder_ / name).string();
  }

  fs::path folder_ = fs::temp_directory_path() / ("oaslam_leftover_" + std::to_string(getpid()));
};

TEST_F(LeftoverTest, FilesAndEmptyFoldersAreRemoved) {
  const fs::path outer = folder_ / "outer", full = folder_ / "full";
  fs::create_directories(outer / "inner");
  fs::create_directories(full);
  const std::string half = File("half"), inside = File("full/result");
  const Leftover a(outer.string()), b((outer / "inner").string()), c(half), d(full.string());
  RemoveLeftovers();
  EXPECT_FALSE(fs::exists(half));
  EXPECT_FALSE(fs::exists(outer));
  EXPECT_TRUE(fs::exists(inside));
}

TEST_F(LeftoverTest, WhatIsCompleteStays) {
  const std::string complete = File("complete");
  { const Leftover leftover(complete); }
  RemoveLeftovers();
  EXPECT_TRUE(fs::exists(complete));
}

TEST_F(LeftoverTest, PlacesAreUsedAgainAndMoreThanThereAreDoNoHarm) {
  for (int round = 0; round < 3; ++round) {
    std::deque<Leftover> many;
    for (int i = 0; i < 100; ++i) many.emplace_back("/nonexistent/" + std::to_string(i));
  }
  const std::string half = File("half");
  const Leftover leftover(half);
  RemoveLeftovers();
  EXPECT_FALSE(fs::exists(half));
}

TEST_F(LeftoverTest, ASignalHandlerMayCallIt) {
  const std::string half = File("half");
  const Leftover leftover(half);
  EXPECT_EXIT(
      {
        std::signal(SIGTERM, [](int) {
          RemoveLeftovers();
          _exit(3);
        });
        raise(SIGTERM);
      },
      testing::ExitedWithCode(3), "");
  EXPECT_FALSE(fs::exists(half));
}

}  // namespace
}  // namespace oaslam
