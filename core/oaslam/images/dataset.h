#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/image_source.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// A folder in the layout of a known dataset or recorder, and what is in it.
struct Dataset {
  std::string layout;  // its name, e.g. "EuRoC"
  // All images, with their times; empty where the images are in the video `film`.
  std::vector<ListedImage> images;
  std::string film, camera, imu;  // paths; empty: none
  // Reads the true poses, camera to world, with the times of the images; empty: there are none.
  // Throws InputError.
  std::function<std::vector<StampedPose>()> truth;
};

std::vector<std::string> DatasetLayouts();

// Recognises the layout of a folder by the files in it: that of options.dataset, or any; nothing
// for another source, for "none", and for a folder that grows. Throws InputError where the folder
// is not in the layout that is asked for, and for files in it that are damaged.
std::optional<Dataset> FindDataset(const std::string& folder, const ImageSourceOptions& options);

// The path of the video in a dataset's folder; for any other source, the source itself.
std::string FilmOf(const std::string& source, const ImageSourceOptions& options);

}  // namespace oaslam
