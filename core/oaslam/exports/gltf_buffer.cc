#include "oaslam/exports/gltf_buffer.h"

#include <bit>
#include <filesystem>
#include <limits>

#include "oaslam/formats/base64.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

// Numbers of the glTF 2.0 specification, sections 3.6 and 4.4.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr uint32_t kGlbMagic = 0x46546C67, kGlbVersion = 2, kJsonChunk = 0x4E4F534A,
                   kBinChunk = 0x004E4942;

static_assert(std::endian::native == std::endian::little);

void AppendWord(std::string& bytes, size_t value) {
  OASLAM_CHECK(value <= std::numeric_limits<uint32_t>::max());
  const auto word = static_cast<uint32_t>(value);
  bytes.append(reinterpret_cast<const char*>(&word), sizeof(word));
}

void AppendChunk(std::string& bytes, uint32_t kind, std::string content, char padding) {
  content.resize((content.size() + 3) / 4 * 4, padding);
  AppendWord(bytes, content.size());
  AppendWord(bytes, kind);
  bytes += content;
}

// `inlined`: the bytes are part of the document.
void AddBuffer(GltfBuffer::Json& document, const GltfBuffer& buffer, bool inlined) {
  if (buffer.IsEmpty()) return;
  document["buffers"] = {{{"byteLength", buffer.bytes().size()}}};
  if (inlined)
    document["buffers"][0]["uri"] =
        "data:application/octet-stream;base64," + EncodeBase64(buffer.bytes());
  document["bufferViews"] = buffer.views();
  document["accessors"] = buffer.accessors();
}

}  // namespace

int GltfBuffer::AddView(const void* data, size_t size, int target, Json accessor) {
  OASLAM_CHECK(size > 0 && bytes_.size() % 4 == 0);  // all components have four bytes
  accessor["bufferView"] = views_.size();
  Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", size}};
  if (target != 0) view["target"] = target;
  views_.push_back(std::move(view));
  bytes_.append(static_cast<const char*>(data), size);
  accessors_.push_back(std::move(accessor));
  return static_cast<int>(accessors_.size()) - 1;
}

int GltfBuffer::AddVectors(const std::vector<Eigen::Vector3d>& vectors) {
  std::vector<Eigen::Vector3f> floats;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const Eigen::Vector3d& v : vectors) {
    floats.emplace_back(v.cast<float>());
    low = low.cwiseMin(floats.back());
    high = high.cwiseMax(floats.back());
  }
  const auto bound = [](const Eigen::Vector3f& v) { return Json{v.x(), v.y(), v.z()}; };
  return AddView(floats.data(), floats.size() * sizeof(Eigen::Vector3f), kArrayBuffer,
                 {{"componentType", kFloat},
                  {"count", floats.size()},
                  {"type", "VEC3"},
                  {"min", bound(low)},
                  {"max", bound(high)}});
}

int GltfBuffer::AddIndices(const std::vector<uint32_t>& indices) {
  return AddView(indices.data(), indices.size() * sizeof(uint32_t), kElementArrayBuffer,
                 {{"componentType", kUnsignedInt}, {"count", indices.size()}, {"type", "SCALAR"}});
}

int GltfBuffer::AddTimes(const std::vector<double>& seconds) {
  const std::vector<float> floats(seconds.begin(), seconds.end());
  return AddView(floats.data(), floats.size() * sizeof(float), 0,
                 {{"componentType", kFloat},
                  {"count", floats.size()},
                  {"type", "SCALAR"},
                  {"min", {floats.front()}},
                  {"max", {floats.back()}}});
}

int GltfBuffer::AddPositions(const std::vector<Eigen::Vector3d>& positions) {
  std::vector<Eigen::Vector3f> floats;
  for (const Eigen::Vector3d& v : positions) floats.emplace_back(v.cast<float>());
  return AddView(floats.data(), floats.size() * sizeof(Eigen::Vector3f), 0,
                 {{"componentType", kFloat}, {"count", floats.size()}, {"type", "VEC3"}});
}

int GltfBuffer::AddRotations(const std::vector<Eigen::Quaterniond>& rotations) {
  std::vector<Eigen::Vector4f> floats;
  for (const Eigen::Quaterniond& q : rotations)
    floats.emplace_back(q.normalized().coeffs().cast<float>());
  return AddView(floats.data(), floats.size() * sizeof(Eigen::Vector4f), 0,
                 {{"componentType", kFloat}, {"count", floats.size()}, {"type", "VEC4"}});
}

std::string GlbBytes(GltfBuffer::Json document, const GltfBuffer& buffer) {
  AddBuffer(document, buffer, false);
  std::string chunks;
  AppendChunk(chunks, kJsonChunk, JsonText(document), ' ');
  if (!buffer.IsEmpty()) AppendChunk(chunks, kBinChunk, buffer.bytes(), '\0');
  std::string bytes;
  AppendWord(bytes, kGlbMagic);
  AppendWord(bytes, kGlbVersion);
  AppendWord(bytes, 12 + chunks.size());
  return bytes + chunks;
}

void SaveGltf(const std::string& path, GltfBuffer::Json document, const GltfBuffer& buffer) {
  if (std::filesystem::path(path).extension() == ".glb")
    return WriteTextFile(path, GlbBytes(std::move(document), buffer));
  AddBuffer(document, buffer, true);
  WriteTextFile(path, JsonText(document, 1) + "\n");
}

}  // namespace oaslam
