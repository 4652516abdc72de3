#include "oaslam/formats/imu_pose.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

Rigid3 MotionOfMatrix(const YAML::Node& node, const std::string& path, const std::string& key) {
  const Rigid3 motion = YamlMotion(node, path, key);
  constexpr double kMost = 10;
  const double length = motion.translation.norm();
  if (length > kMost)
    throw BadInput("{}: {}: its translation is {:.6g} m long, allowed: 0 to {} m{}", path, key,
                   length, kMost, length < 1000 * kMost ? "; is it in millimetres?" : "");
  return motion;
}

struct MatrixKey {
  std::string_view name;
  bool is_imu_from_cam;
};
constexpr MatrixKey kImuPoseKeys[] = {{"T_BS", true}, {"T_cam_imu", false}, {"T_imu_cam", true},
                                      {"Tbc", true},  {"IMU.T_b_c1", true}, {"body_T_cam0", true}};

bool Agree(const Rigid3& a, const Rigid3& b) {
  constexpr double kMostAngle = 0.5 * kDegree, kMostLength = 0.005;  // rounding
  return a.rotation.angularDistance(b.rotation) < kMostAngle &&
         (a.translation - b.translation).norm() < kMostLength;
}

}  // namespace

std::optional<Rigid3> LoadCameraFromImu(const std::string& camera) {
  if (camera.starts_with("fov:")) return std::nullopt;
  const std::string text = ReadTextFile(camera);
  const auto has = [&](const MatrixKey& key) { return text.find(key.name) != std::string::npos; };
  // A kind of file that cannot have them may be no YAML.
  if (std::ranges::none_of(kImuPoseKeys, has)) return std::nullopt;
  const YAML::Node root = ParseYamlMapping(text, camera);
  std::optional<Rigid3> found;
  std::string first;
  const auto look_in = [&](const YAML::Node& node, const std::string& place) {
    for (const MatrixKey& key : kImuPoseKeys) {
      const std::string name(key.name);
      const YAML::Node matrix = node[name];
      if (!matrix) continue;
      const Rigid3 given = MotionOfMatrix(matrix, camera, place + name);
      const Rigid3 motion = key.is_imu_from_cam ? given.Inverse() : given;
      if (found && !Agree(*found, motion))
        throw BadInput("{}: {} and {} contradict each other; leave the wrong one out", camera,
                       first, place + name);
      if (!found) first = place + name;
      found = found.value_or(motion);
    }
  };
  look_in(root, "");
  if (const YAML::Node cam0 = root["cam0"]; cam0 && cam0.IsMap()) look_in(cam0, "cam0.");
  return found;
}

std::optional<Rigid3> LoadBodyFromCamera(const std::string& camera) {
  const std::string text = ReadTextFile(camera);
  if (text.find("T_BS") == std::string::npos) return std::nullopt;
  const YAML::Node node = ParseYamlMapping(text, camera)["T_BS"];
  return node ? std::optional(MotionOfMatrix(node, camera, "T_BS")) : std::nullopt;
}

}  // namespace oaslam
