#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/image_source.h"
#include "oaslam/images/depth_files.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// A pose of the image with this path or name.
struct NamedPose {
  std::string name;
  Rigid3 world_from_cam;
};

// A folder in the layout of a known dataset or recorder, and what is in it.
struct Dataset {
  std::string layout;  // its name, e.g. "EuRoC"
  // All images, with their times; empty where the images are in the video `film`.
  std::vector<ListedImage> images;
  std::string film, camera, imu;  // paths; empty: none
  // Of the images of the film, from 0 on, where the recorder has them in a list and the film's own
  // are only a count; empty: the film's own.
  std::vector<double> film_times;
  double imu_begin_s = 0;  // what the IMU's clock shows when that of the images shows 0
  // The pose of the IMU relative to the camera, where its axes are known of the recorder's phones;
  // its place is not known, and 0.
  std::optional<Rigid3> cam_from_imu{};
  std::optional<DepthFiles> depth;
  // Reads the true poses, camera to world, with the times of the images; empty: there are none.
  // Throws InputError.
  std::function<std::vector<StampedPose>()> truth;
  // The same poses by the names of the images, where their times are not the recording's: they are
  // a ground truth of the images of these names, and of no others. Empty: the times are right.
  std::function<std::vector<NamedPose>()> named_truth;
};

std::vector<std::string> DatasetLayouts();

// Recognises the layout of a folder by the files in it: that of options.dataset, or any; nothing
// for another source, for "none", and for a folder that grows. Throws InputError where the folder
// is not in the layout that is asked for, and for files in it that are damaged.
std::optional<Dataset> FindDataset(const std::string& folder, const ImageSourceOptions& options);

// As FindDataset, also without images: a ground truth alone.
std::optional<Dataset> FindTruth(const std::string& folder, const ImageSourceOptions& options);

// The poses at the times of the images that have the same base name, whatever the extension. Throws
// InputError, which begins with `path`, where there is none, or two have one name.
std::vector<StampedPose> AtTimesOf(const std::vector<ListedImage>& images,
                                   const std::vector<NamedPose>& poses, const std::string& path);

struct FilmSource {
  std::string path;
  std::vector<double> times;  // as Dataset::film_times
};

// The video in a dataset's folder; for any other source, the source itself.
FilmSource FilmOf(const std::string& source, const ImageSourceOptions& options);

}  // namespace oaslam
