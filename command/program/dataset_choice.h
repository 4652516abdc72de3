#pragma once

#include <string>
#include <vector>

#include "common.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::apps {

// What a folder in the layout of a dataset may give, where it is not given otherwise. Null: not
// wanted.
struct FromDataset {
  std::string* camera = nullptr;  // the path of a calibration; empty: not given
  std::string* imu = nullptr;     // that of a gyroscope, for which the camera tells how it lies
  std::vector<StampedPose>* truth = nullptr;  // the true poses
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
