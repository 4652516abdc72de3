#pragma once

#include <functional>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/images/image_files.h"

namespace oaslam {

struct InputImage {
  int index = 0;         // in the whole source, 0-based
  double timestamp = 0;  // seconds
  std::string name;      // base name without directory, e.g. "000123.png"; of a video "%06d"
  cv::Mat
      image;  // 8-bit, one or three channels (BGR); empty where the file is missing or unreadable
  std::string path{};                              // of its own file; empty for videos and cameras
  Orientation orientation = Orientation::kStored;  // as which that file is read
};

// A folder of images that grows while it is read.
struct FollowOptions {
  double quiet_s = 0;             // ends when no image has come for so long; 0: never
  std::function<bool()> stopped;  // asked several times a second; empty: never
};

struct ImageSourceOptions {
  std::optional<double> fps{};  // folders of images (30 else) and videos (the times they hold else)
  int from = 0;                 // first index
  int to = -1;                  // one past the last; -1: all
  bool color = false;           // BGR rather than grey
  Orientation orientation = Orientation::kStored;  // of image files; videos are always upright
  std::optional<FollowOptions> follow{};
  bool color_if_free = false;  // BGR from videos and cameras, whose grey image is made of it anyhow
};

// A sequence of images, read one at a time.
class ImageSource {
 public:
  virtual ~ImageSource() = default;
  // The next image, nothing at the end. An unreadable image comes back empty and with its name: the
  // caller warns and goes on.
  virtual std::optional<InputImage> Next() = 0;
  // Images within [from, to) where known beforehand, -1 otherwise.
  virtual int size() const = 0;
  // From another thread: a Next that waits, and any later one, may return nothing from now on. A
  // source whose Next may wait without end must heed it.
  virtual void Stop() {}
};

// Opens a TUM folder (has rgb.txt), a list file ("timestamp path" or "path" a line), a folder of
// images, a video file (OpenVideo) or "webcam:N" (docs/formats.md). With options.follow, a folder
// of images alone: it may be empty yet. Throws InputError: nothing there, empty list, a line that
// is neither.
std::unique_ptr<ImageSource> OpenImages(const std::string& source,
                                        const ImageSourceOptions& options);

// One image of a source, not read.
struct ListedImage {
  double timestamp = 0;
  std::string path;
};

// The images of a TUM folder, a list file or a folder in [from, to); nothing for a video or a
// camera. Throws as OpenImages.
std::optional<std::vector<ListedImage>> ListImages(const std::string& source,
                                                   const ImageSourceOptions& options);

}  // namespace oaslam
