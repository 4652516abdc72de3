#include "oaslam/formats/imu_file.h"

#include <utility>

#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/table_file.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/geometry/angular_velocity_check.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// A rigid motion of four rows, as a list, a list of lists, or OpenCV's "data".
Rigid3 MotionOfMatrix(const YAML::Node& node, const std::string& path, const std::string& key) {
  std::vector<double> values;
  if (node.IsSequence() && node.size() == 4 && node[0].IsSequence())
    for (const YAML::Node& row : node)
      for (const double x : YamlNumbers(row, path, key)) values.push_back(x);
  else
    values = node.IsMap() ? YamlNumbers(node["data"], path, key + ".data")
                          : YamlNumbers(node, path, key);
  if (values.size() != 16)
    throw BadInput("{}: {}: {} values, expected 16", path, key, values.size());
  constexpr double kRounded = 1e-3;  // by who wrote the file
  const std::optional<Rigid3> motion = PoseOfRows(values, kRounded);
  if (!motion)
    throw BadInput("{}: {}: its first three rows and columns are no rotation", path, key);
  return *motion;
}

// Time stamps in another unit than nanoseconds are wrong by a factor of a thousand or more, which
// no gyroscope's rate explains. `line`: of the first sample.
void CheckSpacing(const std::vector<AngularVelocity>& samples, const std::string& path,
                  size_t line) {
  constexpr double kLeast = 1e-4, kMost = 0.1;  // s
  std::vector<double> spacings;
  for (size_t i = 1; i < samples.size(); ++i)
    spacings.push_back(samples[i].timestamp - samples[i - 1].timestamp);
  if (spacings.empty()) return;
  const double median = Median(std::move(spacings));
  if (median < kLeast || median > kMost)
    throw BadInput(
        "{}:{}: time stamps from here on: median spacing {:.3g} s, allowed: {} to {} s; the first "
        "column is in ns",
        path, line, median, kLeast, kMost);
}

}  // namespace

std::optional<Eigen::Quaterniond> LoadCameraFromImu(const std::string& camera) {
  if (camera.starts_with("fov:")) return std::nullopt;
  const std::string text = ReadTextFile(camera);
  if (text.find("T_BS") == std::string::npos && text.find("T_cam_imu") == std::string::npos)
    return std::nullopt;  // a kind of file that cannot have them may be no YAML
  const YAML::Node root = ParseYamlMapping(text, camera);
  if (const YAML::Node node = root["T_BS"])
    return MotionOfMatrix(node, camera, "T_BS").rotation.conjugate();
  if (const YAML::Node cam0 = root["cam0"]; cam0 && cam0.IsMap() && cam0["T_cam_imu"])
    return MotionOfMatrix(cam0["T_cam_imu"], camera, "cam0.T_cam_imu").rotation;
  return std::nullopt;
}

std::optional<Rigid3> LoadBodyFromCamera(const std::string& camera) {
  const std::string text = ReadTextFile(camera);
  if (text.find("T_BS") == std::string::npos) return std::nullopt;
  const YAML::Node node = ParseYamlMapping(text, camera)["T_BS"];
  return node ? std::optional(MotionOfMatrix(node, camera, "T_BS")) : std::nullopt;
}

std::vector<AngularVelocity> LoadImu(const std::string& path,
                                     const Eigen::Quaterniond& camera_from_imu) {
  std::vector<AngularVelocity> samples;
  const std::string text = ReadTextFile(path);
  size_t number = 0, first_number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const std::string_view content = Trim(line);
    if (content.empty() || content.front() == '#') continue;
    const auto fields = SplitCommas(content);
    const auto value = [&](size_t column) { return NumberAt(fields, column, path, number); };
    constexpr double kNanosecond = 1e-9;
    const AngularVelocity sample{kNanosecond * value(0),
                                 camera_from_imu * Eigen::Vector3d(value(1), value(2), value(3))};
    const double* last = samples.empty() ? nullptr : &samples.back().timestamp;
    if (const std::string problem = ProblemOf(sample, last); !problem.empty())
      throw BadInput("{}:{}: {}", path, number, problem);
    if (samples.empty()) first_number = number;
    samples.push_back(sample);
  }
  if (samples.empty())
    throw BadInput("{}: no line \"timestamp [ns],w_x,w_y,w_z [rad/s]\" as in EuRoC's data.csv",
                   path);
  CheckSpacing(samples, path, first_number);
  return samples;
}

}  // namespace oaslam
