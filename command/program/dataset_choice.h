#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common.h"
#include "oaslam/images/depth_files.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::apps {

struct SideFiles;

// What a folder in the layout of a dataset may give, where it is not given otherwise. Null: not
// wanted.
struct FromDataset {
  std::string* camera = nullptr;  // the path of a calibration; empty: not given
  // Its IMU, where the camera or the recorder tells how that lies.
  SideFiles* side = nullptr;
  std::vector<StampedPose>* truth = nullptr;  // the true poses
  std::optional<DepthFiles>* depth = nullptr;
};

// Takes it from the folder of the images, if that is one, and says in one line what was taken.
// Throws InputError.
void TakeDataset(const std::string& images, const CommonOptions& common, const FromDataset& into);

// A ground truth: a trajectory file, or a folder in the layout of a dataset. Where that has names
// of images without times, they are matched with the names of `images`, the source of what is
// compared with it (empty: not known). Throws InputError.
std::vector<StampedPose> LoadGroundtruth(const std::string& path, const CommonOptions& common,
                                         const std::string& images);

}  // namespace oaslam::apps
