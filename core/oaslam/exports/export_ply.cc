#include "oaslam/exports/export_ply.h"

#include <fmt/format.h>

#include <bit>

#include "oaslam/exports/map_export.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename T>
void AppendBytes(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

}  // namespace

void SavePly(const std::string& path, const ColoredMesh& mesh) {
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment oaslam\nelement vertex {}\nproperty float "
      "x\nproperty float y\n"
      "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n",
      mesh.vertices.size());
  if (!mesh.triangles.empty())
    bytes += fmt::format("element face {}\nproperty list uchar int vertex_indices\n",
                         mesh.triangles.size());
  bytes += "end_header\n";
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    AppendBytes(bytes, std::array<float, 3>{static_cast<float>(mesh.vertices[i].x()),
                                            static_cast<float>(mesh.vertices[i].y()),
                                            static_cast<float>(mesh.vertices[i].z())});
    AppendBytes(bytes, mesh.colors[i]);
  }
  for (const auto& triangle : mesh.triangles) {
    bytes += '\3';
    AppendBytes(bytes, triangle);
  }
  WriteTextFile(path, bytes);
}

void ExportPly(const std::string& path, const SavedMap& saved, bool ellipsoids) {
  ColoredMesh mesh;
  saved.map.landmarks.ForEach(
      [&](LandmarkId, const Landmark& landmark) { mesh.vertices.push_back(landmark.position); });
  mesh.colors.assign(mesh.vertices.size(), kLandmarkColor);
  if (ellipsoids) {
    const TriangleMesh sphere = UnitSphere();
    for (const ExportedObject& o : ExportedObjects(saved)) {
      const auto first = static_cast<uint32_t>(mesh.vertices.size());
      const Eigen::Matrix3d axes = ScaledAxes(o.object->ellipsoid);
      for (const Eigen::Vector3d& v : sphere.vertices)
        mesh.vertices.push_back(o.object->ellipsoid.center + axes * v);
      mesh.colors.resize(mesh.vertices.size(), o.color);
      for (const auto& [a, b, c] : sphere.triangles)
        mesh.triangles.push_back({first + a, first + b, first + c});
    }
  }
  SavePly(path, mesh);
}

}  // namespace oaslam
