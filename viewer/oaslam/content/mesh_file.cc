#include "oaslam/content/mesh_file.h"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "oaslam/formats/text.h"
#include "oaslam/images/image_files.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/srgb.h"
#include "oaslam/util/uri.h"

namespace oaslam {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxTriangles = 2'000'000;  // a detailed scan; some hundred megabytes

Eigen::Vector3f ToEigen(const aiVector3D& v) { return {v.x, v.y, v.z}; }
Eigen::Vector3f ToLinear(const Eigen::Vector3f& srgb) {
  return srgb.unaryExpr(&LinearFromSrgb<float>);
}

// The texel index in [0, size) of a coordinate of a repeating texture.
int TexelOf(float coordinate, int size) {
  const float turn = coordinate - std::floor(coordinate);
  return std::isfinite(turn) ? std::min(static_cast<int>(turn * static_cast<float>(size)), size - 1)
                             : 0;
}

class Loader {
 public:
  explicit Loader(const std::string& path) : path_(path) {}

  Mesh Load();

 private:
  void CheckGlbHeader() const;
  void AddNode(const aiNode& node, const aiMatrix4x4& parent);
  void AddMesh(const aiMesh& mesh, const Eigen::Affine3f& model_from_mesh);
  Eigen::Vector3f BaseColor(const aiMaterial& material) const;
  const cv::Mat& TextureOf(const aiMaterial& material);
  cv::Mat ReadTexture(const std::string& name) const;
  InputError Error(const std::string& what) const { return BadInput("{}: {}", path_, what); }

  const std::string path_;
  Assimp::Importer importer_;
  const aiScene* scene_ = nullptr;
  bool is_gltf_ = false;  // colours of glTF are linear, those of other formats sRGB
  std::map<std::string, cv::Mat> textures_;
  Mesh mesh_;
};

// Assimp takes as much memory as the header of a .glb file says (glTF 2.0, 4.4).
void Loader::CheckGlbHeader() const {
  std::array<char, 20> header{};
  std::ifstream(path_, std::ios::binary).read(header.data(), header.size());
  if (std::string_view(header.data(), 4) != "glTF") return;
  uint64_t length = 0;  // of the first chunk, little-endian
  for (int i = 3; i >= 0; --i)
    length = length << 8 | static_cast<unsigned char>(header[static_cast<size_t>(12 + i)]);
  std::error_code error;
  const uintmax_t size = fs::file_size(path_, error);
  if (error || size < header.size() || length > size - header.size())
    throw Error(fmt::format("cannot be read as a model: a chunk of {} bytes, in a file of {}",
                            length, size));
}

Mesh Loader::Load() {
  std::error_code error;
  if (!fs::is_regular_file(path_, error)) throw Error("there is no such file");
  CheckGlbHeader();
  scene_ = importer_.ReadFile(
      path_, aiProcess_Triangulate | aiProcess_SortByPType | aiProcess_ValidateDataStructure);
  if (!scene_)
    throw Error(fmt::format("cannot be read as a model: {}", importer_.GetErrorString()));
  size_t faces = 0;
  for (unsigned i = 0; i < scene_->mNumMeshes; ++i) faces += scene_->mMeshes[i]->mNumFaces;
  if (faces > kMaxTriangles)
    throw Error(fmt::format("{} triangles; allowed: up to {}", faces, kMaxTriangles));
  // Normals are made last: for a model that is too large assimp would take minutes.
  scene_ = importer_.ApplyPostProcessing(aiProcess_GenSmoothNormals);
  if (!scene_)
    throw Error(fmt::format("cannot be read as a model: {}", importer_.GetErrorString()));
  const std::string extension = LowerExtension(path_);
  is_gltf_ = extension == ".glb" || extension == ".gltf";
  AddNode(*scene_->mRootNode, aiMatrix4x4());
  if (mesh_.triangles.empty()) throw Error("a model without triangles");
  for (const Eigen::Vector3f& p : mesh_.positions)
    if (!p.allFinite()) throw Error("a vertex whose position is not a number");
  if (!(BoundsOf(mesh_).LongestSide() > 0)) throw Error("a model without extent");
  return std::move(mesh_);
}

void Loader::AddNode(const aiNode& node, const aiMatrix4x4& parent) {
  const aiMatrix4x4 transform = parent * node.mTransformation;
  Eigen::Affine3f model_from_mesh;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column)
      model_from_mesh.matrix()(row, column) = transform[row][column];
  model_from_mesh.makeAffine();
  for (unsigned i = 0; i < node.mNumMeshes; ++i)
    AddMesh(*scene_->mMeshes[node.mMeshes[i]], model_from_mesh);
  for (unsigned i = 0; i < node.mNumChildren; ++i) AddNode(*node.mChildren[i], transform);
}

void Loader::AddMesh(const aiMesh& mesh, const Eigen::Affine3f& model_from_mesh) {
  if ((mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE) == 0) return;
  // A mesh may be placed by several nodes.
  if (mesh_.triangles.size() + mesh.mNumFaces > kMaxTriangles)
    throw Error(fmt::format("more triangles than allowed: up to {}", kMaxTriangles));
  const aiMaterial& material = *scene_->mMaterials[mesh.mMaterialIndex];
  const Eigen::Vector3f base = BaseColor(material);
  const cv::Mat& texture = TextureOf(material);
  const Eigen::Matrix3f linear = model_from_mesh.linear();
  const bool is_mirrored = linear.determinant() < 0;
  // Normals are transformed by the cofactors, which exist for a flattened mesh, too.
  Eigen::Matrix3f normal_matrix;
  for (int i = 0; i < 3; ++i)
    normal_matrix.col(i) = linear.col((i + 1) % 3).cross(linear.col((i + 2) % 3));
  if (is_mirrored) normal_matrix = -normal_matrix;
  const auto first = static_cast<uint32_t>(mesh_.positions.size());
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    mesh_.positions.emplace_back(model_from_mesh * ToEigen(mesh.mVertices[i]));
    Eigen::Vector3f normal = Eigen::Vector3f::UnitY();
    if (mesh.HasNormals()) {
      const Eigen::Vector3f turned = normal_matrix * ToEigen(mesh.mNormals[i]);
      if (const float length = turned.norm(); length > 0 && std::isfinite(length))
        normal = turned / length;
    }
    mesh_.normals.push_back(normal);
    Eigen::Vector3f color = base;
    if (mesh.HasVertexColors(0)) {
      const aiColor4D& c = mesh.mColors[0][i];
      const Eigen::Vector3f given(c.r, c.g, c.b);
      color = color.cwiseProduct(is_gltf_ ? given : ToLinear(given));
    }
    if (!texture.empty() && mesh.HasTextureCoords(0)) {
      const aiVector3D& uv = mesh.mTextureCoords[0][i];  // assimp's origin is at the bottom left
      const auto& bgr =
          texture.at<cv::Vec3b>(TexelOf(1 - uv.y, texture.rows), TexelOf(uv.x, texture.cols));
      color = color.cwiseProduct(ToLinear(Eigen::Vector3f(bgr[2], bgr[1], bgr[0]) / 255.0F));
    }
    if (!color.allFinite()) throw Error("a vertex whose color is not a number");
    mesh_.colors.emplace_back(color.cwiseMax(0).cwiseMin(1));
  }
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices != 3) continue;
    const uint32_t a = first + face.mIndices[0], b = first + face.mIndices[1],
                   c = first + face.mIndices[2];
    mesh_.triangles.push_back(is_mirrored ? std::array{a, c, b} : std::array{a, b, c});
  }
}

Eigen::Vector3f Loader::BaseColor(const aiMaterial& material) const {
  aiColor4D color(1, 1, 1, 1);
  if (material.Get(AI_MATKEY_BASE_COLOR, color) != aiReturn_SUCCESS)
    material.Get(AI_MATKEY_COLOR_DIFFUSE, color);
  const Eigen::Vector3f rgb(color.r, color.g, color.b);
  return is_gltf_ ? rgb : ToLinear(rgb);
}

const cv::Mat& Loader::TextureOf(const aiMaterial& material) {
  static const cv::Mat kNone;
  for (const aiTextureType type : {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}) {
    aiString name;
    if (material.GetTexture(type, 0, &name) != aiReturn_SUCCESS) continue;
    const auto [it, is_new] = textures_.try_emplace(name.C_Str());
    if (is_new) it->second = ReadTexture(name.C_Str());
    return it->second;
  }
  return kNone;
}

// Empty where the texture cannot be read: the model then has its material's colour.
cv::Mat Loader::ReadTexture(const std::string& name) const {
  const aiTexture* embedded = scene_->GetEmbeddedTexture(name.c_str());
  if (!embedded) {
    const fs::path folder = fs::path(path_).parent_path();
    const cv::Mat image = ReadImage((folder / name).string(), true);
    return image.empty() ? ReadImage((folder / DecodePercent(name).value_or(name)).string(), true)
                         : image;
  }
  if (embedded->mHeight > 0) {  // uncompressed texels
    const cv::Mat bgra(static_cast<int>(embedded->mHeight), static_cast<int>(embedded->mWidth),
                       CV_8UC4, embedded->pcData);
    cv::Mat bgr(bgra.size(), CV_8UC3);
    cv::mixChannels({bgra}, {bgr}, {0, 0, 1, 1, 2, 2});
    return bgr;
  }
  try {
    const cv::Mat bytes(1, static_cast<int>(embedded->mWidth), CV_8UC1, embedded->pcData);
    return cv::imdecode(bytes, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  } catch (const cv::Exception&) {
    return {};
  }
}

}  // namespace

Mesh LoadMesh(const std::string& path) { return Loader(path).Load(); }

}  // namespace oaslam
