#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/export.h"

namespace oaslam {

// How an image file is read. Calibrations and boxes usually refer to the stored pixels.
enum class Orientation {
  kStored,   // the pixels as stored in the file
  kUpright,  // rotated (and mirrored) by its EXIF orientation, or by a HEIC's own transformations
};

// An image and its origin.
struct InputImage {
  int index = 0;         // in the whole source, 0-based
  double timestamp = 0;  // seconds
  std::string name;      // base name without directory, e.g. "000123.png"; of a video "%06d"
  // 8-bit, one or three channels (BGR); empty where the file is missing or unreadable.
  cv::Mat image;
  std::string path{};  // of the image's own file; empty for videos and cameras
  Orientation orientation = Orientation::kStored;  // the orientation in which that file is read
  // For an image of a live camera: the time when it was taken, or a little later, in seconds of
  // std::chrono::steady_clock.
  std::optional<double> taken_s{};
};

// Options for a folder of images that grows while it is read.
struct FollowOptions {
  double quiet_s = 0;  // the source ends when no image has come for this long; 0: never
};

// Which images of a source are read, and how.
struct ImageSourceOptions {
  // Rate of folders of images (default 30) and of videos (default: their time stamps).
  std::optional<double> fps{};
  int from = 0;                                    // first index
  int to = -1;                                     // one past the last; -1: all
  bool color = false;                              // BGR rather than grey
  Orientation orientation = Orientation::kStored;  // of image files; videos are always upright
  std::optional<FollowOptions> follow{};
  // BGR from videos and cameras, which decode to BGR anyway; image files stay grey.
  bool color_if_free = false;
  // The unit of the time stamps in a list or in image names, in seconds: 1, 1e-3, 1e-6 or 1e-9.
  // Where it is empty, the unit of names that are dates is recognised, and that of a list which
  // names it in its header ("[ns]"); other times are taken as seconds, and refused where the step
  // between images does not look like seconds.
  std::optional<double> time_unit{};
  // Suppresses log messages about the source, because another reader of the same source writes
  // them.
  bool quiet = false;
  // The layout of a folder of a known dataset or recorder: its name (docs/formats.md), "none", or
  // empty: it is recognised by its files.
  std::string dataset{};
  // Ends a wait for images of a camera or a growing folder; checked several times a second, also by
  // other threads. Empty: never.
  std::function<bool()> stopped{};
  // The topic of images in a recording of ROS; empty: its only one.
  std::string topic{};
};

// A sequence of images, read one at a time:
//
//   const std::unique_ptr<ImageSource> source = OpenImages("walk.mp4");
//   while (const std::optional<InputImage> image = source->Next())
//     if (!image->image.empty()) slam.Process({image->image, image->timestamp});
class OASLAM_API ImageSource {
 public:
  virtual ~ImageSource() = default;
  // The next image, nothing at the end. An unreadable image is returned empty with its name; the
  // caller should warn and continue.
  virtual std::optional<InputImage> Next() = 0;
  // The number of images within [from, to); -1 where it is not known beforehand.
  virtual int size() const = 0;
  // May be called from another thread: a waiting Next, and all later ones, may return nothing from
  // then on. A source whose Next can wait forever must implement it.
  virtual void Stop() {}
};

// Opens a folder in the layout of a dataset (docs/formats.md), a list file ("timestamp path" or
// "path" in each line), a folder of images, a video file (OpenVideo), a recording of ROS (an MCAP
// file, a ROS 1 bag or a rosbag2; docs/robots.md) or a camera: "webcam:N", "usb:N", "/dev/videoN"
// or an address (docs/command.md). Names that are times, as in "1341847980.7.png", give the times
// and the order of a folder, and of a list without times. With options.follow only a folder of
// images is allowed, which may still be empty. Throws InputError where the source does not exist or
// is a pipe, a list is empty, a line has neither form, the unit of its times is not seconds, or a
// recording has several topics of images and options.topic names none. FFmpeg writes its own
// messages about a damaged video to stderr, or to where av_log_set_callback directs them.
OASLAM_API std::unique_ptr<ImageSource> OpenImages(const std::string& source,
                                                   const ImageSourceOptions& options = {});

// An image of a source that is not read yet.
struct ListedImage {
  double timestamp = 0;
  std::string path;
};

// The images of a dataset, a list file or a folder in [from, to); nothing for a video, a recording
// of ROS or a camera. Throws as OpenImages.
OASLAM_API std::optional<std::vector<ListedImage>> ListImages(const std::string& source,
                                                              const ImageSourceOptions& options);

// The focal length that a source's metadata states, as 35 mm equivalent in millimetres: that of a
// 36 mm x 24 mm frame with the same angle over its diagonal (CIPA DCG-001). An image of w x h
// pixels then has the focal length f = f35 * sqrt(w^2 + h^2) / 43.27 pixels if it shows the whole
// sensor. Video is often cropped (another aspect ratio, stabilisation), which makes f longer by 5
// to 30 %, so that it is only a start value.
//
// `source` as for OpenImages. It is read from the tag that Apple's devices write into a video's
// container, from EXIF's FocalLengthIn35mmFilm (0xA405) in a JPEG, HEIC or AVIF file, and for a
// folder or list from its first image. Nothing for a camera, where it is not stated (or stated as
// 0, "unknown", or outside of 2 to 3000), and where the source cannot be read, which OpenImages
// reports.
OASLAM_API std::optional<double> FocalLength35mm(const std::string& source);

}  // namespace oaslam
