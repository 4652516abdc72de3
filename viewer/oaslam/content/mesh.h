#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace oaslam {

// A model of virtual content, in its own unit: y up, standing on the origin, its front towards +z,
// as in glTF.
struct Mesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;  // by vertex, of unit length
  std::vector<Eigen::Vector3f> colors;   // by vertex, linear RGB in [0, 1], as glTF's COLOR_0
  std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside
};

struct MeshBounds {
  Eigen::Vector3f min, max;

  float LongestSide() const { return (max - min).maxCoeff(); }
};

// The mesh must have vertices.
MeshBounds BoundsOf(const Mesh& mesh);

// The mesh as a file of glTF 2.0 in its binary form.
std::string GlbOf(const Mesh& mesh, const std::string& name);

}  // namespace oaslam
