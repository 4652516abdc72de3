#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace oaslam {

// The binary buffer of a glTF 2.0 file, with the views and accessors that describe it.
class GltfBuffer {
 public:
  using Json = nlohmann::ordered_json;

  // These return the index of the new accessor. Vectors are stored as floats, with the bounds that
  // positions must have.
  int AddVectors(const std::vector<Eigen::Vector3d>& vectors);
  int AddIndices(const std::vector<uint32_t>& indices);
  // Of an animation: its times in seconds, which must ascend as floats, and the values at them, as
  // vectors or as quaternions (x y z w).
  int AddTimes(const std::vector<double>& seconds);
  int AddPositions(const std::vector<Eigen::Vector3d>& positions);
  int AddRotations(const std::vector<Eigen::Quaterniond>& rotations);

  bool IsEmpty() const { return bytes_.empty(); }
  const std::string& bytes() const { return bytes_; }
  const Json& views() const { return views_; }
  const Json& accessors() const { return accessors_; }

 private:
  // `target`: what a renderer binds the bytes to; 0: nothing.
  int AddView(const void* data, size_t size, int target, Json accessor);

  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

// The bytes of a binary file (.glb) with the document and its buffer.
std::string GlbBytes(GltfBuffer::Json document, const GltfBuffer& buffer);

// Writes the document with its buffer to one file: binary where the path ends in .glb, else text.
void SaveGltf(const std::string& path, GltfBuffer::Json document, const GltfBuffer& buffer);

}  // namespace oaslam
