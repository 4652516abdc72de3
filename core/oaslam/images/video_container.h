#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace oaslam {

// The times at which the images of a video are shown, in that order, from its container.
struct VideoTimes {
  // Strictly ascending, the first is 0; empty where the container has no usable times.
  std::vector<double> seconds;
  double start = 0;  // seconds from the start of the stream, as FFmpeg has it, to the first image
  int repaired = 0;  // number of times that were equal to the previous one and have been moved
};

// Information in a container on its first video stream.
struct VideoContainer {
  int images = 0;     // number of shown images: without those that an edit list hides
  int announced = 0;  // number in the header, 0 if unknown; larger where the file is truncated
  // Whether the last image is at the end that the header announces: then the images that are
  // missing were never recorded, and nothing was cut off.
  bool ends_in_time = false;
  VideoTimes times;
  // Width to height of a stored pixel, as players stretch the width; 1 where the file states no
  // ratio, or one that no camera has, which `odd_pixel_ratio` then holds.
  double pixel_ratio = 1, odd_pixel_ratio = 1;
  int turn_deg = 0;   // clockwise rotation that makes the stored images upright: 0, 90, 180 or 270
  std::string codec;  // e.g. "hevc"
  std::string other_streams{};  // sizes of other video streams that are no cover pictures
};

// Reads the whole file once, without decoding. Throws InputError where the file has no video, or no
// decoder for its video exists.
VideoContainer ReadVideoContainer(const std::string& path);

// Index of the time of a decoded image. `next`: one above that of the previous image. `reported`:
// the decoder's time in seconds since the start of the stream. Images that cannot be decoded may be
// missing, but not all decoders report useful times: a reported time is only used if it is a time
// of the container, from `next` on; otherwise the result is `next`, which may be one past the last.
size_t TimeIndexOf(const VideoTimes& times, size_t next, double reported);

// Makes ascending times strictly ascending by spreading equal ones up to the next larger one.
// Returns how many were moved.
int SpreadEqualTimes(std::vector<double>& ascending);

// The value of a tag of the file or of its first video stream whose name ends with `name_end`;
// nothing where there is none or no video.
std::optional<std::string> ReadVideoTag(const std::string& path, std::string_view name_end);

// Keeps FFmpeg's libraries from printing to stderr, in the whole program. Only for programs, which
// report errors themselves: in the library it would replace an application's callback.
void SilenceFfmpeg();

}  // namespace oaslam
