#include "oaslam/images/list_clock.h"

#include <numeric>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/log.h"

namespace oaslam {
namespace {

struct Continued {
  std::vector<double> times;
  std::string said;
};

Continued Continue(const std::vector<double>& times) {
  std::vector<ListedImage> images;
  for (const double time : times) images.push_back({time, "a.png"});
  std::vector<int> lines(times.size());
  std::iota(lines.begin(), lines.end(), 101);
  Continued result;
  SetLogSink([&](LogLevel, const std::string& message) { result.said += message + "\n"; });
  ContinueTimes("l.txt", lines, false, images);
  SetLogSink({});
  for (const ListedImage& image : images) result.times.push_back(image.timestamp);
  return result;
}

// `count` times from `first` on, in steps of 0.1 s.
void Append(std::vector<double>& times, double first, int count) {
  for (int i = 0; i < count; ++i) times.push_back(first + 0.1 * i);
}

void ExpectSteps(const std::vector<double>& times) {
  for (size_t i = 1; i < times.size(); ++i)
    EXPECT_NEAR(times[i] - times[i - 1], 0.1, 1e-9) << "at " << i;
}

TEST(ListClock, GoesOnWhereItWasSetBack) {
  for (const double back : {0.5, 3.0, 10.0, 1e6}) {
    std::vector<double> times;
    Append(times, 1e6, 30);
    Append(times, 1e6 + 3 - back, 30);
    const Continued continued = Continue(times);
    EXPECT_EQ(continued.times[29], times[29]);
    ExpectSteps(continued.times);
    EXPECT_THAT(continued.said, HasSubstrs("l.txt:131: ", "30 images from here", "ground truth"));
  }
}

TEST(ListClock, GoesOnEachTimeThatARecordingIsPlayedAgain) {
  std::vector<double> times;
  for (int lap = 0; lap < 4; ++lap) Append(times, 5, 40);
  const Continued continued = Continue(times);
  ExpectSteps(continued.times);
  EXPECT_THAT(continued.said, HasSubstrs("l.txt:141: ", "l.txt:181: ", "l.txt:221: "));
}

TEST(ListClock, IsBelievedAgainWhenItIsRight) {
  std::vector<double> times;
  Append(times, 100, 30);
  Append(times, 50, 20);
  Append(times, 110, 30);
  const Continued continued = Continue(times);
  EXPECT_NEAR(continued.times[30], 103, 1e-9);
  EXPECT_NEAR(continued.times[49], 104.9, 1e-9);
  EXPECT_EQ(continued.times[50], 110);
  EXPECT_THAT(continued.said, HasSubstr("20 images from here"));
}

TEST(ListClock, LeavesSingleImagesAsTheyAre) {
  std::vector<double> times;
  Append(times, 0, 30);
  std::swap(times[10], times[11]);
  times[20] = times[19];
  std::swap(times[28], times[29]);
  const Continued continued = Continue(times);
  EXPECT_EQ(continued.times, times);
  EXPECT_EQ(continued.said, "");
}

// 1, 10, 100, 101, ... as a list of names is sorted.
TEST(ListClock, LeavesAListThatIsNotInTheOrderOfTime) {
  std::vector<std::string> names;
  for (int i = 0; i < 300; ++i) names.push_back(std::to_string(i));
  std::ranges::sort(names);
  std::vector<double> times;
  for (const std::string& name : names) times.push_back(std::stod(name));
  const Continued continued = Continue(times);
  EXPECT_EQ(continued.times, times);
  EXPECT_THAT(continued.said, HasSubstr("sort its lines by time"));
}

// All images of a list are read.
TEST(ListClock, IsThatOfAList) {
  const TempFolder folder;
  std::string list;
  for (int i = 0; i < 20; ++i) list += std::to_string(1000 + i - (i < 10 ? 0 : 50)) + " a.png\n";
  const auto images = ListImages(folder.Write("l.txt", list), {.time_unit = 1, .quiet = true});
  ASSERT_EQ(images->size(), 20U);
  EXPECT_EQ(images->at(10).timestamp, 1010);
  EXPECT_EQ(images->at(19).timestamp, 1019);
}

}  // namespace
}  // namespace oaslam
