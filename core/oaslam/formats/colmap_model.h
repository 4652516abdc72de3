#pragma once

#include <string>
#include <vector>

#include "oaslam/rigid3.h"

namespace oaslam {

// The camera of an image in a model of COLMAP.
struct ColmapPose {
  std::string name;  // path of the image, relative to the folder of all images
  Rigid3 cam_from_world;
};

// Reads images.txt or images.bin. Throws InputError that names path and line or image.
std::vector<ColmapPose> LoadColmapPoses(const std::string& path);

// Converts a cameras.bin to the text of a cameras.txt. Throws InputError.
std::string TextOfColmapCameras(const std::string& path);

}  // namespace oaslam
