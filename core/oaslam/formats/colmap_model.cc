#include "oaslam/formats/colmap_model.h"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/read_file.h"

namespace oaslam {
namespace {

static_assert(std::endian::native == std::endian::little, "COLMAP's binary files are as in memory");

class ColmapBytes {
 public:
  explicit ColmapBytes(const std::string& path)
      : path_(path), bytes_(ReadFile(path, size_t{1} << 32)) {}

  template <typename T>
  T Read() {
    T value;
    std::memcpy(&value, Take(sizeof(T)), sizeof(T));
    return value;
  }
  double Number() {
    const auto value = Read<double>();
    if (!std::isfinite(value)) throw BadInput("{}: a number is not finite", path_);
    return value;
  }
  std::string Name() {
    const size_t end = bytes_.find('\0', at_);
    if (end == std::string::npos) Take(bytes_.size());
    std::string name = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return name;
  }
  const char* Take(size_t size) {
    if (size > bytes_.size() - at_)
      throw BadInput("{}: ends early, at byte {}", path_, bytes_.size());
    at_ += size;
    return bytes_.data() + at_ - size;
  }
  // `count` things of `size` bytes.
  void Skip(uint64_t count, size_t size) {
    if (count > bytes_.size() / size) Take(bytes_.size() + 1 - at_);
    Take(count * size);
  }

 private:
  std::string path_, bytes_;
  size_t at_ = 0;
};

std::vector<ColmapPose> ReadBinaryPoses(const std::string& path) {
  ColmapBytes bytes(path);
  std::vector<ColmapPose> poses;
  for (auto left = bytes.Read<uint64_t>(); left > 0; --left) {
    bytes.Read<uint32_t>();   // the image's number
    std::array<double, 4> q;  // w first
    for (double& x : q) x = bytes.Number();
    Eigen::Vector3d translation;
    for (double& x : translation) x = bytes.Number();
    bytes.Read<uint32_t>();  // the camera's number
    const std::string name = bytes.Name();
    bytes.Skip(bytes.Read<uint64_t>(), 2 * sizeof(double) + sizeof(uint64_t));
    poses.push_back({name, PoseOfQuaternion({q[0], q[1], q[2], q[3]}, translation,
                                            fmt::format("{}: image {}", path, Quoted(name)))});
  }
  return poses;
}

// Two lines an image: the second one has its points, and may be empty.
std::vector<ColmapPose> ReadTextPoses(const std::string& path) {
  const std::string text = ReadTextFile(path);
  std::vector<ColmapPose> poses;
  size_t number = 0;
  bool is_of_points = false;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const auto fields = SplitFields(line);
    if (!fields.empty() && fields[0].starts_with('#')) continue;
    if (std::exchange(is_of_points, false)) continue;
    if (fields.empty()) continue;
    std::array<double, 7> v;
    for (size_t i = 0; i < v.size(); ++i) v[i] = NumberAt(fields, i + 1, path, number);
    const std::string place = fmt::format("{}:{}", path, number);
    if (fields.size() < 10)
      throw BadInput("{}: expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME", place);
    const auto begin = static_cast<size_t>(fields[9].data() - line.data());
    poses.push_back({std::string(Trim(line.substr(begin))),
                     PoseOfQuaternion({v[0], v[1], v[2], v[3]}, {v[4], v[5], v[6]}, place)});
    is_of_points = true;
  }
  return poses;
}

}  // namespace

std::vector<ColmapPose> LoadColmapPoses(const std::string& path) {
  return path.ends_with(".bin") ? ReadBinaryPoses(path) : ReadTextPoses(path);
}

std::string TextOfColmapCameras(const std::string& path) {
  ColmapBytes bytes(path);
  std::string text;
  for (auto left = bytes.Read<uint64_t>(); left > 0; --left) {
    const auto id = bytes.Read<uint32_t>(), model = bytes.Read<uint32_t>();
    const auto width = bytes.Read<uint64_t>(), height = bytes.Read<uint64_t>();
    if (model >= std::size(kColmapModels))
      throw BadInput(
          "{}: camera {} has model {}, allowed: 0 to {}; let COLMAP undistort the "
          "images (image_undistorter), or convert the model",
          path, id, model, std::size(kColmapModels) - 1);
    text += fmt::format("{} {} {} {}", id, kColmapModels[model].name, width, height);
    for (size_t i = 0; i < kColmapModels[model].Parameters(); ++i)
      text += fmt::format(" {:.17g}", bytes.Number());
    text += '\n';
  }
  return text;
}

}  // namespace oaslam
