#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <future>
#include <mutex>
#include <thread>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/images/followed_folder.h"
#include "oaslam/latest_image.h"

namespace oaslam {
namespace {

std::string Pgm(char level) { return std::string("P5\n4 4\n255\n").append(16, level); }

ImageSourceOptions Following(double quiet_s = 0, std::function<bool()> stopped = {}) {
  return {.follow = FollowOptions{quiet_s}, .stopped = std::move(stopped)};
}

struct FollowedFolderTest : FolderTest {};

TEST_F(FollowedFolderTest, TakesWhatIsThereAndWhatComesUntilTheStopFile) {
  for (const char* name : {"10.pgm", "9.pgm", "notes.txt"}) folder.Write(name, Pgm(1));
  const auto source = OpenImages(folder.path(), Following());
  EXPECT_EQ(source->size(), -1);
  EXPECT_EQ(source->Next()->name, "9.pgm");
  EXPECT_EQ(source->Next()->name, "10.pgm");
  auto next = std::async(std::launch::async, [&] { return source->Next(); });  // waits
  folder.Write("half.tmp", Pgm(7));
  std::filesystem::rename(folder / "half.tmp", folder / "11.pgm");  // moved in when complete
  const auto moved = next.get();
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->name, "11.pgm");
  EXPECT_EQ(moved->index, 2);
  EXPECT_DOUBLE_EQ(moved->timestamp, 2.0 / 30);
  EXPECT_EQ(moved->image.at<unsigned char>(0, 0), 7);
  folder.Write("12.pgm", Pgm(8));
  folder.Write("9.pgm", Pgm(9));  // written again, but already taken
  folder.Write(kStopFile, "");
  EXPECT_EQ(source->Next()->name, "12.pgm");
  EXPECT_FALSE(source->Next());
}

TEST_F(FollowedFolderTest, AnImageThatWasNotWholeComesAgainWhenItIs) {
  folder.Write("1.pgm", "P5\n4 4");
  const auto source = OpenImages(folder.path(), Following());
  EXPECT_TRUE(source->Next()->image.empty());
  folder.Write("1.pgm", Pgm(5));
  const auto whole = source->Next();
  EXPECT_EQ(whole->image.at<unsigned char>(0, 0), 5);
  EXPECT_EQ(whole->index, 0);  // not used up by the incomplete one
}

TEST_F(FollowedFolderTest, NamesThatAreTimesGiveTheTimes) {
  for (const char* name : {"9.966667.pgm", "9.933333.pgm", "._9.9.pgm"}) folder.Write(name, Pgm(1));
  const auto source = OpenImages(folder.path(), Following());
  EXPECT_EQ(source->Next()->timestamp, 9.933333);
  EXPECT_EQ(source->Next()->timestamp, 9.966667);
  folder.Write("10.033333.pgm", Pgm(1));
  folder.Write("10.0.pgm", Pgm(1));
  folder.Write("preview.pgm", Pgm(1));
  folder.Write("thumb_10.0.pgm", Pgm(1));
  EXPECT_EQ(source->Next()->timestamp, 10.0);
  EXPECT_EQ(source->Next()->timestamp, 10.033333);
  folder.Write("10033.333.pgm", Pgm(1));
  EXPECT_INPUT_ERROR(source->Next(), HasSubstr("median step"));
}

TEST_F(FollowedFolderTest, WhatCameDuringLongWorkIsTaken) {
  folder.Write("a.pgm", Pgm(1));
  const auto source = OpenImages(folder.path(), Following(0.1));
  EXPECT_EQ(source->Next()->name, "a.pgm");
  folder.Write("b.pgm", Pgm(2));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // as if working on a
  const auto next = source->Next();
  ASSERT_TRUE(next);
  EXPECT_EQ(next->name, "b.pgm");
  EXPECT_FALSE(source->Next());
}

TEST_F(FollowedFolderTest, EndsByItself) {
  EXPECT_FALSE(OpenImages(folder.path(), Following(0.2))->Next());  // quiet
  EXPECT_FALSE(
      OpenImages(folder.path(), Following(0, [] { return true; }))->Next());  // told to stop
  folder.Write(kStopFile, "");
  folder.Write("a.pgm", Pgm(1));
  const auto finished = OpenImages(folder.path(), Following());  // the stop file was there before
  EXPECT_EQ(finished->Next()->name, "a.pgm");
  EXPECT_FALSE(finished->Next());
  std::filesystem::create_directories(folder / "sub");
  const auto gone = OpenImages(folder / "sub", Following());
  std::filesystem::remove(folder / "sub");
  EXPECT_FALSE(gone->Next());
}

TEST_F(FollowedFolderTest, RangeAndBadInput) {
  for (const char* name : {"a.pgm", "b.pgm", "c.pgm"}) folder.Write(name, Pgm(1));
  ImageSourceOptions options = Following();
  options.from = 1;
  options.to = 2;
  const auto source = OpenImages(folder.path(), options);
  EXPECT_EQ(source->Next()->name, "b.pgm");
  EXPECT_FALSE(source->Next());
  EXPECT_INPUT_ERROR(OpenImages(folder / "a.pgm", Following()), HasSubstr("--follow"));
  EXPECT_INPUT_ERROR(OpenImages(folder / "nowhere", Following()), HasSubstr("--follow"));
  EXPECT_INPUT_ERROR(OpenImages("webcam:0", Following()), HasSubstr("--follow"));
  EXPECT_INPUT_ERROR(OpenImages(folder.path(), Following(-1)), HasSubstr("--follow -1"));
  folder.Write("rgb.txt", "1.0 a.pgm\n");
  EXPECT_INPUT_ERROR(OpenImages(folder.path(), Following()), HasSubstr("rgb.txt"));
}

// A camera that delivers an image when the test requests it.
class FakeCamera : public ImageSource {
 public:
  explicit FakeCamera(bool fails = false) : fails_(fails) {}
  std::optional<InputImage> Next() override {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return shown_ > taken_ || off_; });
    if (shown_ > taken_) {
      InputImage image;
      image.index = taken_++;
      changed_.notify_all();
      return image;
    }
    changed_.notify_all();
    if (fails_) throw InputError("the cable is out");
    return std::nullopt;
  }
  int size() const override { return -1; }
  void Stop() override { SwitchOff(); }

  // Shows `count` more images, and waits until all are read.
  void Show(int count) {
    std::unique_lock lock(mutex_);
    shown_ += count;
    changed_.notify_all();
    changed_.wait(lock, [this] { return taken_ == shown_; });
  }
  void SwitchOff() {
    const std::lock_guard lock(mutex_);
    off_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  int shown_ = 0, taken_ = 0;
  bool off_ = false, fails_;
};

TEST(LatestImageSource, GivesTheNewestImageAndCountsTheOthers) {
  auto owned = std::make_unique<FakeCamera>();
  FakeCamera& camera = *owned;
  LatestImageSource source(std::move(owned));
  std::vector<int> indices;
  camera.Show(5);
  camera.SwitchOff();  // what was read last is still there after the end
  while (const auto image = source.Next()) indices.push_back(image->index);
  // The image of index 4 cannot be missed; which of the others are seen depends on timing.
  EXPECT_EQ(indices.back(), 4);
  EXPECT_EQ(static_cast<int>(indices.size()) + source.dropped(), 5);
  EXPECT_TRUE(std::ranges::is_sorted(indices));
}

TEST(LatestImageSource, NoImageIsGivenTwice) {
  auto owned = std::make_unique<FakeCamera>();
  FakeCamera& camera = *owned;
  LatestImageSource source(std::move(owned));
  for (int i = 0; i < 3; ++i) {
    auto next = std::async(std::launch::async, [&] { return source.Next(); });
    camera.Show(1);
    EXPECT_EQ(next.get()->index, i);
  }
  EXPECT_EQ(source.dropped(), 0);
  camera.SwitchOff();
  EXPECT_FALSE(source.Next());
  EXPECT_FALSE(source.Next());
}

TEST(LatestImageSource, FailsOnTheReadersThread) {
  auto owned = std::make_unique<FakeCamera>(true);
  owned->SwitchOff();
  LatestImageSource source(std::move(owned));
  EXPECT_INPUT_ERROR(source.Next(), HasSubstr("cable"));
  EXPECT_FALSE(source.Next());
}

// As a thread that ends a program does while another waits for an image.
TEST(LatestImageSource, StopEndsAWaitingNext) {
  struct Blocking : ImageSource {
    std::promise<void> stopped;
    std::optional<InputImage> Next() override {
      stopped.get_future().wait();
      return std::nullopt;
    }
    int size() const override { return -1; }
    void Stop() override { stopped.set_value(); }  // once: else it throws
  };
  LatestImageSource source(std::make_unique<Blocking>());
  auto image = std::async(std::launch::async, [&] { return source.Next(); });
  source.Stop();
  ASSERT_EQ(image.wait_for(std::chrono::seconds(60)), std::future_status::ready);
  EXPECT_FALSE(image.get());
  EXPECT_FALSE(source.Next());
}

TEST(LatestImageSource, NeedsASource) {
  EXPECT_INPUT_ERROR(LatestImageSource(nullptr), HasSubstr("no source"));
}

TEST(LatestImageSource, MayBeGivenUpAtAnyTime) {
  for (int shown = 0; shown < 3; ++shown) {
    auto owned = std::make_unique<FakeCamera>();
    FakeCamera& camera = *owned;
    LatestImageSource source(std::move(owned));
    if (shown > 0) camera.Show(shown);
  }  // it waits for the next image now, or soon
}

TEST(LatestImageSource, AFollowedFolderMayBeGivenUp) {
  const TempFolder folder;
  LatestImageSource empty(OpenImages(folder.path(), Following()));
  folder.Write("a.pgm", Pgm(1));
  LatestImageSource waiting(OpenImages(folder.path(), Following()));
  EXPECT_EQ(waiting.Next()->name, "a.pgm");
}

TEST(OpenCamera, PlaysARecordingAtItsOwnSpeedWithoutWhatCannotBeRead) {
  const TempFolder folder;
  for (const char* name : {"0.pgm", "1.pgm", "2.pgm", "4.pgm"}) folder.Write(name, Pgm(1));
  folder.Write("3.pgm", "P5\n4 4");
  constexpr double kRate = 20;
  const auto begun = std::chrono::steady_clock::now();
  const auto source = OpenCamera(folder.path(), {.fps = kRate});
  std::string last;
  while (const auto image = source->Next()) {
    EXPECT_FALSE(image->image.empty());
    last = image->name;
  }
  EXPECT_EQ(last, "4.pgm");
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
  EXPECT_GE(taken.count(), 4 / kRate);
}

// Two days in one recording are not waited for.
TEST(OpenCamera, PassesOverALongGap) {
  const TempFolder folder;
  for (const char* name : {"a.pgm", "b.pgm", "c.pgm", "d.pgm"}) folder.Write(name, Pgm(1));
  folder.Write("list.txt", "0 a.pgm\n0.1 b.pgm\n0.2 c.pgm\n86400 d.pgm\n");
  const auto source = OpenCamera(folder / "list.txt");
  std::string last;
  while (const auto image = source->Next()) last = image->name;
  EXPECT_EQ(last, "d.pgm");
}

}  // namespace
}  // namespace oaslam
