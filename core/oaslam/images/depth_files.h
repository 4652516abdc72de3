#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/depth_image.h"
#include "oaslam/image_source.h"
#include "oaslam/images/recorded_depths.h"

namespace oaslam {

// The image of a depth camera in a file.
struct DepthFile {
  std::string path;
  std::optional<double> time{};  // seconds, as the images'
  std::string image{};           // the base name of the image that it belongs to; empty: not known
};

// The files of a depth camera beside a recording, and what is known of the camera.
struct DepthFiles {
  std::string path;  // of the folder or the list, for messages
  std::vector<DepthFile> files;
  double unit = 0.001;  // metres, of a count
  // As in DepthImage; nothing: registered.
  std::optional<Camera> camera{};
  Rigid3 cam_from_depth{};
  // A folder of images of the same names as the depths, whose zeros tell which depths not to trust;
  // empty: none.
  std::string confidence{};
  // The topic of depths in the recording of ROS at `path`, which then has no files; empty: files.
  std::string topic{};
};

// Those in a folder, or in a list of lines "time path", "time image time depth" or "time depth time
// image" (TUM's depth.txt and associations.txt, whose unit is 1/5000 m). Throws InputError where
// there are none.
DepthFiles LoadDepthFiles(const std::string& path);
DepthFiles LoadDepthFiles(const std::string& folder, double unit);

// Sets the camera of depths that are not registered: a calibration (LoadCamera) of the size of the
// depth images, with T_cam_depth (4 x 4, from the depth camera's frame to the colour camera's),
// without which both cameras are at one place. Throws InputError.
void SetDepthCamera(const std::string& path, DepthFiles& files);

// Which depth belongs to which image of a source: by the names of the images in an association; by
// times, at most 0.02 s apart; by the last number in both names; or in their order, where there are
// as many of both.
class DepthSource {
 public:
  // `images`: all of the source, with their times. Throws InputError where no depth belongs to any
  // image, and where the first depth is none.
  DepthSource(DepthFiles files, const std::vector<ListedImage>& images);

  // The depth of an image, by its path (of a video, its name); nothing where there is none. Warns
  // of the first file that cannot be read.
  std::optional<DepthImage> Find(const std::string& image);
  const DepthFiles& files() const { return files_; }

 private:
  std::optional<DepthImage> Described(cv::Mat image) const;
  std::optional<DepthImage> FindRecorded(const std::string& image);

  DepthFiles files_;
  std::map<std::string, size_t> file_of_;  // by the path of the image
  std::map<std::string, double> times_;    // of the images, by their names: of a recording
  std::unique_ptr<RecordedDepths> recorded_;
  bool has_warned_ = false;
};

}  // namespace oaslam
