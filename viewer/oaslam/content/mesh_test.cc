#include "oaslam/content/mesh.h"

#include <Eigen/Geometry>
#include <opencv2/imgcodecs.hpp>

#include "expect_input_error.h"
#include "folder_test.h"
#include "oaslam/content/builtin_models.h"
#include "oaslam/content/mesh_file.h"
#include "oaslam/exports/gltf_buffer.h"

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

TEST(GlbOf, IsReadAsItWasWritten) {
  const TempFolder folder;
  for (const auto& [name, mesh] : BuiltinModels()) {
    SCOPED_TRACE(name);
    const Mesh read = LoadMesh(folder.Write(name + ".glb", GlbOf(mesh, name)));
    ASSERT_EQ(read.triangles.size(), mesh.triangles.size());
    // Vertices are numbered differently by some versions of assimp.
    for (size_t i = 0; i < 3 * mesh.triangles.size(); ++i) {
      const uint32_t a = read.triangles[i / 3][i % 3], b = mesh.triangles[i / 3][i % 3];
      ASSERT_LT((read.positions[a] - mesh.positions[b]).norm(), 1e-6);
      ASSERT_LT((read.normals[a] - mesh.normals[b]).norm(), 1e-5);
      ASSERT_LT((read.colors[a] - mesh.colors[b]).norm(), 1e-5);
    }
  }
}

// One red triangle with its material's colour, under a node.
std::string Triangle(const GltfBuffer::Json& node, int mode = 4) {
  using Json = GltfBuffer::Json;
  GltfBuffer buffer;
  const int positions = buffer.AddVectors({{0, 0, 0}, {1, 0, 0}, {0, 2, 0}});
  Json document = {{"asset", {{"version", "2.0"}}}, {"scene", 0}};
  document["scenes"] = Json::array({{{"nodes", Json::array({0})}}});
  document["nodes"] = Json::array({node});
  document["meshes"] = Json::array(
      {{{"primitives",
         Json::array(
             {{{"attributes", {{"POSITION", positions}}}, {"mode", mode}, {"material", 0}}})}}});
  document["materials"] = Json::array(
      {{{"pbrMetallicRoughness", {{"baseColorFactor", Json::array({1, 0.25, 0, 1})}}}}});
  return GlbBytes(document, buffer);
}

struct LoadMeshTest : FolderTest {};

TEST_F(LoadMeshTest, PlacesMeshesByTheirNodes) {
  const Mesh mesh = LoadMesh(folder.Write(
      "a.glb", Triangle({{"mesh", 0}, {"translation", {0, 0, 5}}, {"scale", {-2, 1, 1}}})));
  ASSERT_EQ(mesh.triangles.size(), 1U);
  const MeshBounds bounds = BoundsOf(mesh);
  EXPECT_LT((bounds.min - Eigen::Vector3f(-2, 0, 5)).norm(), 1e-6);
  EXPECT_LT((bounds.max - Eigen::Vector3f(0, 2, 5)).norm(), 1e-6);
  EXPECT_LT((mesh.colors[0] - Eigen::Vector3f(1, 0.25F, 0)).norm(), 1e-5);
  ExpectNormalsOutwards(mesh);  // a mirrored mesh keeps its outer side
}

TEST_F(LoadMeshTest, SamplesTexturesAtVertices) {
  cv::Mat texture(2, 2, CV_8UC3);
  texture.at<cv::Vec3b>(0, 0) = {0, 0, 255};  // top left: red
  texture.at<cv::Vec3b>(0, 1) = {0, 255, 0};
  texture.at<cv::Vec3b>(1, 0) = {255, 0, 0};
  texture.at<cv::Vec3b>(1, 1) = {255, 255, 255};
  ASSERT_TRUE(cv::imwrite(folder / "wood.png", texture));
  folder.Write("box.mtl", "newmtl wood\nKd 1 1 1\nmap_Kd wood.png\n");
  const Mesh mesh =
      LoadMesh(folder.Write("box.obj",
                            "mtllib box.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.2 0.2\nvt 0.8 0.2\n"
                            "vt 0.2 0.8\nusemtl wood\nf 1/1 2/2 3/3\n"));
  ASSERT_EQ(mesh.positions.size(), 3U);
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3f& p = mesh.positions[i];
    const Eigen::Vector3f expected = p.x() > 0.5   ? Eigen::Vector3f(1, 1, 1)
                                     : p.y() > 0.5 ? Eigen::Vector3f(1, 0, 0)
                                                   : Eigen::Vector3f(0, 0, 1);
    EXPECT_LT((mesh.colors[i] - expected).norm(), 0.01) << i;
  }
}

TEST_F(LoadMeshTest, RefusesWhatIsNoModel) {
  const auto refusal = [&](const std::string& path) {
    return InputErrorOf([&] { LoadMesh(path); });
  };
  EXPECT_THAT(refusal(folder / "nowhere.glb"), HasSubstr("nowhere.glb: there is no such file"));
  EXPECT_THAT(refusal(folder.Write("noise.glb", "noise")), HasSubstr("noise.glb: cannot be read"));
  // tools/fuzz gltf: assimp took two gigabytes for such a header.
  std::string huge = Triangle({{"mesh", 0}});
  huge[15] = '\x7f';
  EXPECT_THAT(refusal(folder.Write("huge.glb", huge)), HasSubstr("a chunk of 21"));
  EXPECT_THAT(refusal(folder.Write("noise.xyz", "noise")), HasSubstr("noise.xyz: cannot be read"));
  EXPECT_THAT(refusal(folder.Write("points.glb", Triangle({{"mesh", 0}}, 0))),
              HasSubstr("without triangles"));
  EXPECT_THAT(refusal(folder.Write("flat.glb", Triangle({{"mesh", 0}, {"scale", {0, 0, 0}}}))),
              HasSubstr("without extent"));
}

}  // namespace
}  // namespace oaslam
