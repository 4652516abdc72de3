#pragma once

#include <string>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// COLMAP's models of cameras, in the order of their numbers.
struct ColmapModel {
  const char* name;
  size_t focal_lengths;  // one or two, then cx cy
  size_t coefficients;   // k1 k2 p1 p2 k3 ..., or k1 .. k4 of a fisheye
  LensModel model;

  constexpr size_t Parameters() const { return focal_lengths + 2 + coefficients; }
};
inline constexpr ColmapModel kColmapModels[] = {
    {"SIMPLE_PINHOLE", 1, 0, LensModel::kPinhole},
    {"PINHOLE", 2, 0, LensModel::kPinhole},
    {"SIMPLE_RADIAL", 1, 1, LensModel::kPinhole},
    {"RADIAL", 1, 2, LensModel::kPinhole},
    {"OPENCV", 2, 4, LensModel::kPinhole},
    {"OPENCV_FISHEYE", 2, 4, LensModel::kFisheye},
    {"FULL_OPENCV", 2, 8, LensModel::kPinhole},
    {"FOV", 2, 1, LensModel::kPinhole},
    {"SIMPLE_RADIAL_FISHEYE", 1, 1, LensModel::kFisheye},
    {"RADIAL_FISHEYE", 1, 2, LensModel::kFisheye},
    {"THIN_PRISM_FISHEYE", 2, 8, LensModel::kFisheye}};

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
