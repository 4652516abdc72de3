#include "oaslam/formats/text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>

#include "expect_input_error.h"
#include "temp_folder.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Limits the size of this process's files while it exists, like a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST(ReadTextFile, ADeviceWithoutEndIsRefused) {
  EXPECT_THAT(InputErrorOf([] { ReadTextFile("/dev/zero"); }), HasSubstr("larger than 1024 MiB"));
  EXPECT_EQ(ReadTextFile("/dev/null"), "");
}

TEST(WriteTextFile, AFullDiskLeavesTheOldFileWhole) {
  const TempFolder folder;
  WriteTextFile(folder / "a.txt", "old");
  WriteTextFile(folder / "a.txt", "older no more");
  EXPECT_EQ(folder.Read("a.txt"), "older no more");
  std::string error;
  {
    const FullDisk full(1000);
    error = InputErrorOf([&] { WriteTextFile(folder / "a.txt", std::string(100'000, 'x')); });
  }
  EXPECT_THAT(error, HasSubstr("cannot be written"));
  EXPECT_EQ(folder.Read("a.txt"), "older no more");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}),
            1);  // nothing is left beside it
  EXPECT_THAT(InputErrorOf([&] { WriteTextFile(folder / "no/a.txt", "x"); }),
              HasSubstr("cannot be written"));
  EXPECT_THAT(InputErrorOf([&] { WriteTextFile(folder.path(), "x"); }),
              HasSubstr("cannot be written"));
}

TEST(WriteTextFile, DevicesAndLinksStayWhatTheyAre) {
  const TempFolder folder;
  fs::create_symlink(folder.Write("target.txt", "a longer text"), folder / "link.txt");
  WriteTextFile(folder / "link.txt", "new");
  EXPECT_TRUE(fs::is_symlink(folder / "link.txt"));
  EXPECT_EQ(folder.Read("target.txt"), "new");
  WriteTextFile("/dev/null", "x");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_THAT(InputErrorOf([&] { WriteTextFile("/dev/full", "x"); }),
              HasSubstr("cannot be written"));
}

}  // namespace
}  // namespace oaslam
