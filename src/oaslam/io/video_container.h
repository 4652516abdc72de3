#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// Times of a video's images in the order in which they are shown, as its container holds them.
struct VideoTimes {
  std::vector<double> seconds;  // ascending strictly, the first 0; empty where the container holds none that can be used
  double start = 0;             // seconds of the first image after the start of the stream as FFmpeg has it
  int repaired = 0;             // that were not above the one before, and lie between their neighbours now
};

// Of the first video stream, without decoding it: its packets are read once from end to end. What an edit list leaves out is
// not among them. Throws InputError: no video, or no decoder for it.
VideoTimes ReadVideoTimes(const std::string& path);

// Index of the time that belongs to a decoded image. `next`: one above that of the image before. `reported`: the decoder's time
// in seconds since the start of the stream; images may be missing, but the decoder may also say nothing of use: only what
// is a time of the container, from `next` on, is believed, and it is `next` otherwise.
size_t TimeIndexOf(const VideoTimes& times, size_t next, double reported);

// Makes ascending times ascend strictly, by spreading equal ones up to the next that is larger. Returns how many were moved.
int SpreadEqualTimes(std::vector<double>& ascending);

// Value of a tag of the file or of its first video stream whose name ends so, nothing where there is none or no video.
std::optional<std::string> ReadVideoTag(const std::string& path, std::string_view name_end);

// While one lives, FFmpeg's libraries say nothing on stderr: what matters is said by who asked.
class QuietFfmpeg {
 public:
  QuietFfmpeg();
  ~QuietFfmpeg();
  QuietFfmpeg(const QuietFfmpeg&) = delete;
  QuietFfmpeg& operator=(const QuietFfmpeg&) = delete;

 private:
  int level_;
};

}  // namespace oaslam
