#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// When the images of a video are shown, in that order, as its container holds it.
struct VideoTimes {
  // Ascending strictly, the first 0; empty where the container holds none that can be used.
  std::vector<double> seconds;
  double start = 0;  // seconds of the first image after the start of the stream as FFmpeg has it
  int repaired = 0;  // were equal to the one before, and lie between their neighbours now
};

// What a container says of its first video stream.
struct VideoContainer {
  int images = 0;     // to be shown: without those that an edit list leaves out
  int announced = 0;  // by the header, 0 where it does not tell; more where the file is cut off
  VideoTimes times;
  int turn_deg = 0;   // clockwise, that sets the stored images upright: 0, 90, 180 or 270
  std::string codec;  // e.g. "hevc"
};

// Nothing is decoded, but the file is read once from end to end. Throws InputError: no video, or no
// decoder for it.
VideoContainer ReadVideoContainer(const std::string& path);

// Index of the time that belongs to a decoded image. `next`: one above that of the image before.
// `reported`: the decoder's time in seconds since the start of the stream. Images that cannot be
// decoded may be missing before this one, but not every decoder reports times of use: only what is
// a time of the container, from `next` on, is believed; else it is `next`, which may be one past
// the last.
size_t TimeIndexOf(const VideoTimes& times, size_t next, double reported);

// Makes ascending times ascend strictly, by spreading equal ones up to the next that is larger.
// Returns how many it moved.
int SpreadEqualTimes(std::vector<double>& ascending);

// The value of a tag of the file or of its first video stream whose name ends so; nothing where
// there is none or no video.
std::optional<std::string> ReadVideoTag(const std::string& path, std::string_view name_end);

// While one lives, FFmpeg's libraries say nothing on stderr: who asked them says what matters. From
// any thread. An application's own callback for FFmpeg's messages is lost.
class QuietFfmpeg {
 public:
  QuietFfmpeg();
  ~QuietFfmpeg();
  QuietFfmpeg(const QuietFfmpeg&) = delete;
  QuietFfmpeg& operator=(const QuietFfmpeg&) = delete;
};

}  // namespace oaslam
