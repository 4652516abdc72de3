#pragma once

#include <yaml-cpp/yaml.h>

#include <string>
#include <vector>

namespace oaslam {

// The root of a YAML file, which must be a mapping. Takes OpenCV's header line "%YAML:1.0", too.
// Throws InputError naming path and line.
YAML::Node LoadYamlMapping(const std::string& path);

// "[1, 2]" or "text", shortened, for messages.
std::string Show(const YAML::Node& node);

// A finite number within [min, max]; throws InputError naming path, key, value and bound. Here and
// below the node may be that of a missing key.
double YamlNumber(const YAML::Node& node, const std::string& path, const std::string& key,
                  double min, double max);
int YamlInteger(const YAML::Node& node, const std::string& path, const std::string& key, int min,
                int max);
// A list of finite numbers.
std::vector<double> YamlNumbers(const YAML::Node& node, const std::string& path,
                                const std::string& key);

}  // namespace oaslam
