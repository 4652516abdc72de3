#include "oaslam/content/mesh.h"

#include "oaslam/exports/gltf_buffer.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

std::vector<Eigen::Vector3d> ToDouble(const std::vector<Eigen::Vector3f>& vectors) {
  std::vector<Eigen::Vector3d> doubles;
  doubles.reserve(vectors.size());
  for (const Eigen::Vector3f& v : vectors) doubles.emplace_back(v.cast<double>());
  return doubles;
}

}  // namespace

MeshBounds BoundsOf(const Mesh& mesh) {
  OASLAM_CHECK(!mesh.positions.empty());
  MeshBounds bounds{mesh.positions[0], mesh.positions[0]};
  for (const Eigen::Vector3f& p : mesh.positions) {
    bounds.min = bounds.min.cwiseMin(p);
    bounds.max = bounds.max.cwiseMax(p);
  }
  return bounds;
}

std::string GlbOf(const Mesh& mesh, const std::string& name) {
  using Json = GltfBuffer::Json;
  GltfBuffer buffer;
  std::vector<uint32_t> indices;
  for (const auto& triangle : mesh.triangles)
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  const Json attributes = {{"POSITION", buffer.AddVectors(ToDouble(mesh.positions))},
                           {"NORMAL", buffer.AddVectors(ToDouble(mesh.normals))},
                           {"COLOR_0", buffer.AddVectors(ToDouble(mesh.colors))}};
  const Json primitive = {
      {"attributes", attributes}, {"indices", buffer.AddIndices(indices)}, {"material", 0}};
  // Both sides are visible, since a cloth is a single sheet.
  const Json material = {
      {"name", name},
      {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 0.8}}},
      {"doubleSided", true}};
  const auto list = [](const Json& item) {
    Json items = Json::array();
    items.push_back(item);
    return items;
  };
  return GlbBytes({{"asset", {{"version", "2.0"}, {"generator", "oaslam"}}},
                   {"scene", 0},
                   {"scenes", list({{"nodes", list(0)}})},
                   {"nodes", list({{"name", name}, {"mesh", 0}})},
                   {"meshes", list({{"name", name}, {"primitives", list(primitive)}})},
                   {"materials", list(material)}},
                  buffer);
}

}  // namespace oaslam
