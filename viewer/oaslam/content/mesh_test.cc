#include "oaslam/content/mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string_view>

#include "oaslam/content/builtin_models.h"

namespace oaslam {
namespace {

// Expects that normals point to the side from which triangles are counter-clockwise.
void ExpectNormalsOutwards(const Mesh& mesh) {
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3f face =
        (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
    ASSERT_GT(face.norm(), 0);
    ASSERT_GT(face.dot(mesh.normals[a] + mesh.normals[b] + mesh.normals[c]), 0);
  }
}

TEST(BuiltinModels, StandOnTheirPlaceAndHaveSizeOne) {
  for (const auto& [name, mesh] : BuiltinModels()) {
    SCOPED_TRACE(name);
    const MeshBounds bounds = BoundsOf(mesh);
    EXPECT_NEAR(bounds.LongestSide(), 1, 1e-5);
    EXPECT_NEAR(bounds.min.y(), 0, 1e-6);
    EXPECT_NEAR(bounds.min.x() + bounds.max.x(), 0, 0.01);
    EXPECT_NEAR(bounds.min.z() + bounds.max.z(), 0, 0.01);
    EXPECT_LT(mesh.triangles.size(), 2000U);
    for (const Eigen::Vector3f& n : mesh.normals) ASSERT_NEAR(n.norm(), 1, 1e-4);
    ExpectNormalsOutwards(mesh);
  }
}

// The header of a .glb, its document and its buffer, by the specification of glTF 2.0.
TEST(GlbOf, IsAFileOfGltf) {
  const auto number = [](std::string_view bytes, size_t at) {
    uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof(value));
    return value;
  };
  for (const auto& [name, mesh] : BuiltinModels()) {
    SCOPED_TRACE(name);
    const std::string glb = GlbOf(mesh, name);
    ASSERT_EQ(glb.substr(0, 4), "glTF");
    EXPECT_EQ(number(glb, 4), 2U);
    EXPECT_EQ(number(glb, 8), glb.size());
    const uint32_t json_size = number(glb, 12);
    const auto document = nlohmann::json::parse(glb.substr(20, json_size));
    const std::string_view buffer = std::string_view(glb).substr(20 + json_size + 8);
    EXPECT_EQ(number(glb, 20 + json_size), buffer.size());
    const auto& primitive = document["meshes"][0]["primitives"][0];
    const auto bytes_of = [&](const nlohmann::json& accessor) {
      const auto& view =
          document["bufferViews"]
                  [document["accessors"][accessor.get<size_t>()]["bufferView"].get<size_t>()];
      return buffer.substr(view.value("byteOffset", size_t{0}), view["byteLength"].get<size_t>());
    };
    const std::string_view positions = bytes_of(primitive["attributes"]["POSITION"]);
    ASSERT_EQ(positions.size(), mesh.positions.size() * 3 * sizeof(float));
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      Eigen::Vector3f read;
      std::memcpy(read.data(), positions.data() + 12 * i, 12);
      ASSERT_LT((read - mesh.positions[i]).norm(), 1e-6);
    }
    EXPECT_EQ(document["accessors"][primitive["indices"].get<size_t>()]["count"],
              3 * mesh.triangles.size());
  }
}

}  // namespace
}  // namespace oaslam
