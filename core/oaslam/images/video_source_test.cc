#include "oaslam/images/video_source.h"

#include <algorithm>
#include <atomic>
#include <cstdarg>
#include <functional>
#include <vector>

extern "C" {
#include <libavutil/log.h>
}

#include "expect_input_error.h"
#include "ffmpeg.h"
#include "folder_test.h"
#include "oaslam/images/image_list.h"
#include "oaslam/images/video_container.h"
#include "oaslam/images/video_file.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

using testing::Pointwise;

constexpr double kMillisecond = 1e-3;  // Matroska holds no finer times

struct Film {
  std::vector<double> times;
  std::vector<cv::Size> sizes;
  std::vector<std::string> names, warnings;
  int announced = 0;
};

Film Watch(const std::string& path, const ImageSourceOptions& options = {}) {
  Film film;
  SetLogSink([&](LogLevel, const std::string& message) { film.warnings.push_back(message); });
  const auto source = OpenImages(path, options);
  film.announced = source->size();
  while (const auto image = source->Next()) {
    film.times.push_back(image->timestamp);
    film.sizes.push_back(image->image.size());
    film.names.push_back(image->name);
  }
  SetLogSink({});
  return film;
}

// FFmpeg arguments for two seconds of a test picture at 30 Hz.
std::string Picture(const std::string& size, double seconds = 2) {
  return "-f lavfi -i testsrc=size=" + size + ":rate=30:duration=" + std::to_string(seconds) + " ";
}

// Expects images every 1/30 s, of which some are missing.
bool IsKept(int n) { return n < 12 || n % 3 == 0 || n % 7 == 1; }
const std::string kIrregular =
    "-vf \"select='lt(n,12)+not(mod(n,3))+eq(mod(n,7),1)'\" -fps_mode passthrough ";
std::vector<double> IrregularTimes() {
  std::vector<double> times;
  for (int n = 0; n < 60; ++n)
    if (IsKept(n)) times.push_back(n / 30.0);
  return times;
}

std::vector<double> RegularTimes(int count, double rate = 30) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(i / rate);
  return times;
}

void Overwrite(std::string& bytes, size_t at, const std::string& by) {
  std::copy(by.begin(), by.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

struct VideoSourceTest : FolderTest {};

TEST_F(VideoSourceTest, TimesAreThoseStored) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  const std::string make = Picture("160x120") + kIrregular + "-c:v libx264 -bf 3 ";
  // In MP4 an edit list moves them to 0, in the others they begin elsewhere.
  for (const std::string name : {"a.mp4", "a.mkv", "a.ts", "late.mp4", "late.mkv"}) {
    ASSERT_TRUE(RunFfmpeg(make + (name.starts_with("late") ? "-output_ts_offset 5.5 " : "") +
                          folder / name));
    const Film film = Watch(folder / name);
    EXPECT_THAT(film.times, Pointwise(DoubleNear(kMillisecond), IrregularTimes())) << name;
    EXPECT_EQ(film.announced, static_cast<int>(film.times.size())) << name;
    EXPECT_THAT(film.warnings, IsEmpty()) << name;
  }
  const Film part = Watch(folder / "a.mp4", {.from = 10, .to = 20});
  const std::vector<double> times = IrregularTimes();
  EXPECT_THAT(part.times, Pointwise(DoubleNear(kMillisecond),
                                    std::vector(times.begin() + 10, times.begin() + 20)));
  EXPECT_EQ(part.names.front(), "000010");
  EXPECT_EQ(part.announced, 10);
  EXPECT_THAT(Watch(folder / "a.mp4", {.fps = 10}).times,
              Pointwise(DoubleNear(1e-9), RegularTimes(static_cast<int>(times.size()), 10)));
}

TEST_F(VideoSourceTest, TheTimesOfARecordersListCount) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  ASSERT_TRUE(RunFfmpeg(Picture("160x120") + "-frames:v 3 -c:v libx264 " + folder / "rgb.mp4"));
  folder.Write("camera_matrix.csv", "150, 0, 80\n0, 150, 60\n0, 0, 1\n");
  folder.Write("odometry.csv", "timestamp, frame\n7.5, 0\n7.6, 1\n7.9, 2\n");
  const std::vector<double> listed = {0, 0.1, 0.4};
  const Film film = Watch(folder.path());
  EXPECT_THAT(film.times, Pointwise(DoubleNear(1e-9), listed));
  EXPECT_THAT(film.warnings, IsEmpty());
  EXPECT_NEAR(TimesOfImages(folder.path(), {}).at(2).timestamp, 0.4, 1e-9);
  EXPECT_THAT(Watch(folder.path(), {.fps = 10}).times,
              Pointwise(DoubleNear(1e-9), RegularTimes(3, 10)));
  const std::vector<double> own = Watch(folder / "rgb.mp4").times;
  // A list of other images, and one whose clock goes back.
  folder.Write("odometry.csv", "timestamp, frame\n7.5, 0\n7.6, 1\n");
  const Film other = Watch(folder.path());
  EXPECT_THAT(other.times, Pointwise(DoubleNear(1e-9), own));
  EXPECT_THAT(other.warnings, ElementsAre(HasSubstrs("has 3 images, but 2 times are listed")));
  folder.Write("odometry.csv", "timestamp, frame\n7.5, 0\n7.6, 1\n7.6, 2\n");
  EXPECT_THAT(Watch(folder.path()).times, Pointwise(DoubleNear(1e-9), own));
}

TEST_F(VideoSourceTest, OtherVideoStreamsAreSaid) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  ASSERT_TRUE(RunFfmpeg(Picture("144x108", 0.2) + Picture("96x64", 0.2) +
                        "-map 0 -map 1 -c:v libx264 " + folder / "two.mkv"));
  const Film film = Watch(folder / "two.mkv");
  EXPECT_EQ(film.sizes.front(), cv::Size(144, 108));
  EXPECT_THAT(film.warnings, ElementsAre(HasSubstrs("two.mkv", "96 x 64", "the first is taken")));
}

TEST_F(VideoSourceTest, PixelsAreMadeSquare) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  const auto watch = [&](const std::string& name, const std::string& filter) {
    EXPECT_TRUE(
        RunFfmpeg(Picture("144x108", 0.2) + "-vf " + filter + " -c:v libx264 " + folder / name));
    return Watch(folder / name);
  };
  const Film wide = watch("wide.mp4", "setsar=4/3");  // as HDV
  EXPECT_EQ(wide.sizes.front(), cv::Size(192, 108));
  EXPECT_THAT(wide.warnings, ElementsAre(HasSubstrs("wide.mp4", "1.333")));
  EXPECT_EQ(watch("narrow.mkv", "setsar=8/9").sizes.front(), cv::Size(128, 108));  // as NTSC DV
  const Film square = watch("square.mp4", "setsar=1");
  EXPECT_EQ(square.sizes.front(), cv::Size(144, 108));
  EXPECT_THAT(square.warnings, IsEmpty());
  const Film odd = watch("odd.mp4", "setsar=20");
  EXPECT_EQ(odd.sizes.front(), cv::Size(144, 108));
  EXPECT_THAT(odd.warnings, ElementsAre(HasSubstr("not believed")));
  // A turned film: its stored width is what is stretched.
  std::string bytes = folder.Read("wide.mp4");
  const std::string zero(4, '\0'), one("\0\1\0\0", 4), minus_one("\xff\xff\0\0", 4);
  Overwrite(bytes, bytes.find("tkhd") + 44, zero + one + zero + minus_one + zero);
  EXPECT_EQ(Watch(folder.Write("turned.mp4", bytes)).sizes.front(), cv::Size(108, 192));
}

TEST_F(VideoSourceTest, WhatAnEditListLeavesOutIsNotCounted) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  ASSERT_TRUE(RunFfmpeg(Picture("160x120") + "-c:v libx264 -g 20 -keyint_min 20 -sc_threshold 0 " +
                        folder / "whole.mp4"));
  ASSERT_TRUE(RunFfmpeg("-ss 0.9 -i " + folder / "whole.mp4" + " -c copy " + folder / "cut.mp4"));
  const Film film = Watch(folder / "cut.mp4");
  EXPECT_THAT(film.times, Pointwise(DoubleNear(kMillisecond), RegularTimes(33)));
  EXPECT_THAT(film.warnings, IsEmpty());
}

TEST_F(VideoSourceTest, ImagesThatCannotBeDecodedTakeTheirTimesWithThem) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx265");
  // Begins with images that depend on others before the cut.
  ASSERT_TRUE(RunFfmpeg(
      Picture("160x120") +
      "-c:v libx265 -x265-params log-level=none:keyint=20:min-keyint=20:scenecut=0:open-gop=1 " +
      folder / "whole.ts"));
  ASSERT_TRUE(RunFfmpeg("-ss 0.9 -i " + folder / "whole.ts" + " -c copy " + folder / "cut.mkv"));
  const Film film = Watch(folder / "cut.mkv");
  ASSERT_LT(static_cast<int>(film.times.size()), film.announced);
  EXPECT_THAT(film.times, Pointwise(DoubleNear(2 * kMillisecond),
                                    RegularTimes(static_cast<int>(film.times.size()))));
  EXPECT_THAT(film.warnings, ElementsAre(HasSubstr("images could not be decoded")));
}

TEST_F(VideoSourceTest, GoesOnBehindADamagedImage) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  ASSERT_TRUE(RunFfmpeg(Picture("160x120") + "-c:v libx264 -g 10 -bf 0 " + folder / "a.mp4"));
  std::string bytes = folder.Read("a.mp4");
  const size_t begin = bytes.find("mdat");
  ASSERT_NE(begin, std::string::npos);
  const size_t middle = begin + (bytes.find("moov") - begin) / 2;
  Overwrite(bytes, middle, std::string(600, '\xee'));
  const Film film = Watch(folder.Write("b.mp4", bytes));
  EXPECT_GT(film.times.size(), 40u);
  EXPECT_NEAR(film.times.back(), 59 / 30.0, kMillisecond);  // in spite of those that are missing
  EXPECT_TRUE(std::ranges::is_sorted(film.times, std::less_equal{}));
}

TEST_F(VideoSourceTest, WithoutTimesItTakesTheRateAndSaysSo) {
  OASLAM_SKIP_WITHOUT_ENCODER("libx264");
  ASSERT_TRUE(RunFfmpeg(Picture("160x120", 0.5) + "-c:v libx264 -f h264 " + folder / "raw.264"));
  ASSERT_TRUE(RunFfmpeg(Picture("160x120", 0.5) + "-c:v libx264 " + folder / "once.ts"));
  folder.Write("twice.ts",
               folder.Read("once.ts") + folder.Read("once.ts"));  // whose times restart
  for (const auto& [name, count] : {std::pair("raw.264", 15), std::pair("twice.ts", 30)}) {
    const Film film = Watch(folder / name);
    EXPECT_EQ(film.times, RegularTimes(count, film.times.size() > 1 ? 1 / film.times[1] : 0))
        << name;
    EXPECT_THAT(film.warnings, ElementsAre(HasSubstrs(name, "no time stamps", "--fps"))) << name;
    EXPECT_THAT(Watch(folder / name, {.fps = 30}).warnings, IsEmpty());
  }
}

TEST_F(VideoSourceTest, IsUprightAsPhonesTurnIt) {
  cv::Mat picture(120, 160, CV_8UC3, cv::Scalar::all(20));
  picture(cv::Rect(0, 0, 80, 60)).setTo(240);  // the stored image is bright at the top left
  VideoFile video(folder / "a.mp4");
  for (int i = 0; i < 5; ++i) video.Add(picture, i / 30.0);
  video.Finish();
  struct Turn {
    // Of the display matrix (x, y) -> (ax + cy, bx + dy) in the track's header (ISO/IEC 14496-12,
    // 6.2.2).
    std::string a, b, c, d;
    bool left, top;  // where it is bright then
    cv::Size size;
  };
  const std::string zero(4, '\0'), one("\0\1\0\0", 4), minus_one("\xff\xff\0\0", 4);
  for (const Turn& turn : {Turn{one, zero, zero, one, true, true, {160, 120}},
                           Turn{zero, one, minus_one, zero, false, true, {120, 160}},
                           Turn{minus_one, zero, zero, minus_one, false, false, {160, 120}},
                           Turn{zero, minus_one, one, zero, true, false, {120, 160}}}) {
    std::string bytes = folder.Read("a.mp4");
    const size_t header = bytes.find("tkhd");
    ASSERT_NE(header, std::string::npos);
    constexpr size_t kMatrix = 4 + 40;
    Overwrite(bytes, header + kMatrix, turn.a + turn.b + zero + turn.c + turn.d);
    for (const bool color : {false, true}) {
      const auto image = OpenImages(folder.Write("turned.mp4", bytes), {.color = color})->Next();
      ASSERT_TRUE(image);
      ASSERT_EQ(image->image.size(), turn.size);
      const cv::Size half = turn.size / 2;
      for (const bool left : {false, true})
        for (const bool top : {false, true}) {
          const cv::Rect quarter(left ? 0 : half.width, top ? 0 : half.height, half.width,
                                 half.height);
          EXPECT_EQ(cv::mean(image->image(quarter))[0] > 128, left == turn.left && top == turn.top);
        }
    }
  }
}

TEST_F(VideoSourceTest, SizesAndDepths) {
  struct Case {
    std::string encoder, options, size;
  };
  for (const Case& c :
       {Case{"libx265", "-x265-params log-level=none -pix_fmt yuv420p10le -tag:v hvc1", "160x120"},
        Case{"libx265",
             "-x265-params log-level=none -preset ultrafast -pix_fmt yuv420p10le -tag:v hvc1",
             "3840x2160"},
        Case{"libx264", "-pix_fmt yuv420p", "1080x1920"},
        Case{"libx264", "-pix_fmt yuv444p", "161x121"}}) {
    if (!HasFfmpegEncoder(c.encoder))
      GTEST_SKIP() << "needs the program ffmpeg with the encoder " << c.encoder;
    ASSERT_TRUE(RunFfmpeg(Picture(c.size, 0.1) + "-c:v " + c.encoder + " " + c.options + " " +
                          folder / "a.mp4"));
    const auto source = OpenImages(folder / "a.mp4", {.color = true});
    for (int i = 0; i < 3; ++i) {
      const auto image = source->Next();
      ASSERT_TRUE(image) << c.size;
      EXPECT_EQ(std::to_string(image->image.cols) + "x" + std::to_string(image->image.rows),
                c.size);
      EXPECT_EQ(image->image.type(), CV_8UC3);
      EXPECT_NEAR(image->timestamp, i / 30.0, kMillisecond);
      // The bars of the test picture have all colours; ten bits read as eight would not.
      cv::Mat channels[3];
      cv::split(image->image, channels);
      for (const cv::Mat& channel : channels) {
        double least = 0, most = 0;
        cv::minMaxLoc(channel, &least, &most);
        EXPECT_LT(least, 30);
        EXPECT_GT(most, 225);
      }
    }
    EXPECT_FALSE(source->Next());
  }
}

std::atomic<int> heard = 0;  // FFmpeg decodes on several threads
void Hear(void*, int, const char*, va_list) { ++heard; }

TEST_F(VideoSourceTest, LeavesTheCallbackOfTheApplication) {
  {
    VideoFile video(folder / "a.mp4");
    for (int i = 0; i < 3; ++i)
      video.Add(cv::Mat(120, 160, CV_8UC3, cv::Scalar::all(90)), i / 30.0);
    video.Finish();
  }
  av_log_set_callback(Hear);
  FocalLength35mm(folder / "a.mp4");
  const auto source = OpenImages(folder / "a.mp4", {});
  while (source->Next()) continue;
  const int before = heard.load();
  av_log(nullptr, AV_LOG_ERROR, "heard");
  EXPECT_EQ(heard.load(), before + 1);
  av_log_set_callback(av_log_default_callback);
}

// Silences FFmpeg, as the command does, which reports errors itself.
TEST_F(VideoSourceTest, WhatCannotBeDecodedIsSaidInOneLine) {
  SilenceFfmpeg();
  {
    VideoFile video(folder / "a.mp4");
    cv::Mat picture(120, 160, CV_8UC3);
    for (int i = 0; i < 5; ++i) {
      cv::randu(picture, 0, 255);
      video.Add(picture, i / 30.0);
    }
    video.Finish();
  }
  const std::string bytes = folder.Read("a.mp4");
  const auto refusal = [&](const std::string& content, const ImageSourceOptions& options = {}) {
    const std::string path = folder.Write("b.mp4", content);
    testing::internal::CaptureStderr();
    const std::string error = InputErrorOf([&] { OpenImages(path, options)->Next(); });
    EXPECT_THAT(testing::internal::GetCapturedStderr(), IsEmpty());
    return error;
  };
  EXPECT_THAT(refusal(bytes, {.from = 5}), HasSubstr("has 5 frames"));
  std::string noise = bytes;
  const size_t data = noise.find("mdat");
  Overwrite(noise, data + 4, std::string(noise.find("moov") - 4 - data - 4, '\x55'));
  EXPECT_THAT(refusal(noise), AllOf(HasSubstr("b.mp4: not one of its images can be decoded"),
                                    Not(HasSubstr("\n"))));
  std::string unknown = bytes;
  for (const char* code : {"avc1", "mp4v"})
    if (const size_t at = unknown.find(code, unknown.find("stsd")); at != std::string::npos)
      Overwrite(unknown, at, "zzz1");
  EXPECT_THAT(refusal(unknown), HasSubstr("b.mp4: there is no decoder for its video"));
  EXPECT_THAT(refusal(bytes.substr(0, data + 200)),
              HasSubstr("b.mp4: neither a list of images nor a video"));
}

}  // namespace
}  // namespace oaslam
