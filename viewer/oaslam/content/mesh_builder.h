#pragma once

#include <Eigen/Core>

#include "oaslam/content/mesh.h"

namespace oaslam {

// Converts 0xrrggbb in sRGB to the linear RGB of a Mesh.
Eigen::Vector3f LinearRgb(uint32_t srgb);

// Builds a mesh from simple bodies of one colour each. Edges of bodies are shaded hard.
class MeshBuilder {
 public:
  using Vector = Eigen::Vector3f;

  // A box along the axes.
  void AddBox(const Vector& min, const Vector& max, const Vector& color);
  // A truncated cone along y; a radius of 0 at either end makes a cone.
  void AddCone(const Vector& bottom, float height, float bottom_radius, float top_radius, int sides,
               const Vector& color);
  void AddEllipsoid(const Vector& center, const Vector& half_axes, int sides, const Vector& color);
  // A sheet that is visible from both sides: corners[row][column], with the
  // same number in each row.
  void AddSheet(const std::vector<std::vector<Vector>>& corners,
                const std::vector<Vector>& row_colors);

  // Returns the mesh, scaled to a longest side of 1.
  Mesh Finish() &&;

 private:
  uint32_t AddVertex(const Vector& position, const Vector& normal, const Vector& color);
  void AddQuad(uint32_t a, uint32_t b, uint32_t c, uint32_t d);
  void AddDisc(const Vector& center, float radius, int sides, float normal_y, const Vector& color);

  Mesh mesh_;
};

}  // namespace oaslam
