#include "oaslam/content/mesh_builder.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "oaslam/util/srgb.h"

namespace oaslam {
namespace {

constexpr float kTurn = 2 * std::numbers::pi_v<float>;

}  // namespace

Eigen::Vector3f LinearRgb(uint32_t srgb) {
  const auto channel = [&](int shift) {
    return LinearFromSrgb(static_cast<float>(srgb >> shift & 0xFF) / 255);
  };
  return {channel(16), channel(8), channel(0)};
}

uint32_t MeshBuilder::AddVertex(const Vector& position, const Vector& normal, const Vector& color) {
  mesh_.positions.push_back(position);
  mesh_.normals.push_back(normal);
  mesh_.colors.push_back(color);
  return static_cast<uint32_t>(mesh_.positions.size() - 1);
}

void MeshBuilder::AddQuad(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
  mesh_.triangles.push_back({a, b, c});
  mesh_.triangles.push_back({a, c, d});
}

void MeshBuilder::AddBox(const Vector& min, const Vector& max, const Vector& color) {
  for (int axis = 0; axis < 3; ++axis)
    for (const bool positive : {false, true}) {
      const int u = (axis + (positive ? 1 : 2)) % 3, v = (axis + (positive ? 2 : 1)) % 3;
      Vector normal = Vector::Zero(), corner = min;
      normal[axis] = positive ? 1.0F : -1.0F;
      if (positive) corner[axis] = max[axis];
      Vector along_u = corner, along_v = corner;
      along_u[u] = max[u];
      along_v[v] = max[v];
      const uint32_t a = AddVertex(corner, normal, color), b = AddVertex(along_u, normal, color);
      AddQuad(a, b, AddVertex(along_u + along_v - corner, normal, color),
              AddVertex(along_v, normal, color));
    }
}

void MeshBuilder::AddDisc(const Vector& center, float radius, int sides, float normal_y,
                          const Vector& color) {
  const Vector normal(0, normal_y, 0);
  const uint32_t middle = AddVertex(center, normal, color);
  for (int i = 0; i < sides; ++i) {
    const float angle = kTurn * static_cast<float>(i) / static_cast<float>(sides);
    AddVertex(center + radius * Vector(std::sin(angle), 0, std::cos(angle)), normal, color);
  }
  const auto count = static_cast<uint32_t>(sides);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t a = middle + 1 + i, b = middle + 1 + (i + 1) % count;
    mesh_.triangles.push_back(normal_y > 0 ? std::array{middle, a, b} : std::array{middle, b, a});
  }
}

void MeshBuilder::AddCone(const Vector& bottom, float height, float bottom_radius, float top_radius,
                          int sides, const Vector& color) {
  const Vector top = bottom + Vector(0, height, 0);
  const auto first = static_cast<uint32_t>(mesh_.positions.size());
  const float slope = (bottom_radius - top_radius) / height;
  for (int i = 0; i <= sides; ++i) {
    const float angle = kTurn * static_cast<float>(i) / static_cast<float>(sides);
    const Vector out(std::sin(angle), 0, std::cos(angle));
    const Vector normal = (out + Vector(0, slope, 0)).normalized();
    AddVertex(bottom + bottom_radius * out, normal, color);
    AddVertex(top + top_radius * out, normal, color);
  }
  for (uint32_t i = 0; i < static_cast<uint32_t>(sides); ++i) {
    const uint32_t a = first + 2 * i;
    if (bottom_radius > 0) mesh_.triangles.push_back({a, a + 2, a + 3});
    if (top_radius > 0) mesh_.triangles.push_back({a, a + 3, a + 1});
  }
  if (bottom_radius > 0) AddDisc(bottom, bottom_radius, sides, -1, color);
  if (top_radius > 0) AddDisc(top, top_radius, sides, 1, color);
}

void MeshBuilder::AddEllipsoid(const Vector& center, const Vector& half_axes, int sides,
                               const Vector& color) {
  const auto first = static_cast<uint32_t>(mesh_.positions.size());
  const int rings = sides / 2;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j <= sides; ++j) {
      const float polar = kTurn / 2 * static_cast<float>(i) / static_cast<float>(rings);
      const float angle = kTurn * static_cast<float>(j) / static_cast<float>(sides);
      const Vector unit(std::sin(polar) * std::sin(angle), std::cos(polar),
                        std::sin(polar) * std::cos(angle));
      AddVertex(center + half_axes.cwiseProduct(unit), unit.cwiseQuotient(half_axes).normalized(),
                color);
    }
  const auto row = static_cast<uint32_t>(sides + 1), last = static_cast<uint32_t>(rings - 1);
  for (uint32_t i = 0; i <= last; ++i)
    for (uint32_t j = 0; j + 1 < row; ++j) {
      const uint32_t a = first + i * row + j, below = a + row;
      if (i > 0) mesh_.triangles.push_back({a, below + 1, a + 1});
      if (i < last) mesh_.triangles.push_back({a, below, below + 1});
    }
}

void MeshBuilder::AddSheet(const std::vector<std::vector<Vector>>& corners,
                           const std::vector<Vector>& row_colors) {
  for (size_t i = 0; i + 1 < corners.size(); ++i) {
    const auto first = static_cast<uint32_t>(mesh_.positions.size());
    const size_t columns = corners[i].size();
    for (size_t j = 0; j < columns; ++j) {
      const size_t before = j == 0 ? 0 : j - 1, after = std::min(j + 1, columns - 1);
      const Vector across = corners[i][after] - corners[i][before],
                   down = corners[i + 1][j] - corners[i][j];
      const Vector normal = down.cross(across).normalized();
      AddVertex(corners[i][j], normal, row_colors[i]);
      AddVertex(corners[i + 1][j], normal, row_colors[i]);
    }
    for (uint32_t j = 0; j + 1 < columns; ++j) {
      const uint32_t a = first + 2 * j;
      AddQuad(a, a + 1, a + 3, a + 2);
    }
  }
}

Mesh MeshBuilder::Finish() && {
  const float scale = 1 / BoundsOf(mesh_).LongestSide();
  for (Vector& p : mesh_.positions) p *= scale;
  return std::move(mesh_);
}

}  // namespace oaslam
