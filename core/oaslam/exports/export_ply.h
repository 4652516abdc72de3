#pragma once

#include <string>
#include <vector>

#include "oaslam/exports/map_scene.h"

namespace oaslam {

struct ColoredMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Rgb> colors;                         // same length
  std::vector<std::array<uint32_t, 3>> triangles;  // may be empty: a cloud of points
};

// Binary little-endian PLY: float x y z, uchar red green blue, faces where there are any.
void SavePly(const std::string& path, const ColoredMesh& mesh);

}  // namespace oaslam
