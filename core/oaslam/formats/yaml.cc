#include "oaslam/formats/yaml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oaslam/formats/pose_values.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
YAML::Node ParseYamlMapping(std::string text, const std::string& path) {
  // OpenCV's directive has a colon, which YAML forbids; blanking it keeps the numbers of lines.
  if (text.starts_with("%YAML")) text.replace(0, std::min(text.find('\n'), text.size()), "");
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    throw BadInput("{}:{}: {}", path, error.mark.line + 1, error.msg);
  }
  if (root.IsNull()) return YAML::Node(YAML::NodeType::Map);
  if (!root.IsMap()) throw BadInput("{}: expected \"key: value\" lines", path);
  return root;
}

std::string TextOfNode(const YAML::Node& node) {
  constexpr size_t kMaxBytes = 60;  // leaves room for path, key and bound in a line of a terminal
  if (!node || node.IsNull()) return "nothing";
  if (node.IsScalar()) return Quoted(node.Scalar());
  YAML::Emitter emitter;
  emitter.SetSeqFormat(YAML::Flow);
  emitter.SetMapFormat(YAML::Flow);
  emitter << node;
  return OnOneLine(emitter.c_str(), kMaxBytes);
}

double YamlNumber(const YAML::Node& node, const std::string& path, const std::string& key,
                  double min, double max) {
  const auto value = node && node.IsScalar() ? ParseNumber(node.Scalar()) : std::nullopt;
  if (!value) throw BadInput("{}: {}: {}, expected a number", path, key, TextOfNode(node));
  if (*value < min || *value > max)
    throw BadInput("{}: {}: {}, allowed: {} to {}", path, key, *value, min, max);
  return *value;
}

int YamlInteger(const YAML::Node& node, const std::string& path, const std::string& key, int min,
                int max) {
  const double value = YamlNumber(node, path, key, min, max);
  if (value != std::floor(value))
    throw BadInput("{}: {}: {}, expected a whole number", path, key, value);
  return static_cast<int>(value);
}

std::vector<double> YamlNumbers(const YAML::Node& node, const std::string& path,
                                const std::string& key) {
  if (!node || !node.IsSequence())
    throw BadInput("{}: {}: {}, expected a list of numbers", path, key, TextOfNode(node));
  std::vector<double> values;
  for (size_t i = 0; i < node.size(); ++i)
    values.push_back(YamlNumber(node[i], path, fmt::format("{}[{}]", key, i)));
  return values;
}

Rigid3 YamlMotion(const YAML::Node& node, const std::string& path, const std::string& key) {
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

}  // namespace oaslam
