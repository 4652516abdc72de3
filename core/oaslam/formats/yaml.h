#pragma once

#include <yaml-cpp/yaml.h>

#include <limits>
#include <string>
#include <vector>

#include "oaslam/rigid3.h"

namespace oaslam {

// The root of a YAML text, which must be a mapping; an empty mapping where the text holds nothing
// but comments. Takes OpenCV's header line "%YAML:1.0", too. Throws InputError naming `path`, that
// of the text, and the line.
YAML::Node ParseYamlMapping(std::string text, const std::string& path);

// [1, 2] or "text" on one line, for messages; shortened to at most 60 bytes.
std::string TextOfNode(const YAML::Node& node);

// A finite number within [min, max]; throws InputError naming path, key, value and bound. Here and
// below the node may be that of a missing key.
double YamlNumber(const YAML::Node& node, const std::string& path, const std::string& key,
                  double min = std::numeric_limits<double>::lowest(),
                  double max = std::numeric_limits<double>::max());
int YamlInteger(const YAML::Node& node, const std::string& path, const std::string& key, int min,
                int max);
// A list of finite numbers.
std::vector<double> YamlNumbers(const YAML::Node& node, const std::string& path,
                                const std::string& key);
// A rigid motion of four rows, as a list, a list of lists, or OpenCV's "data".
Rigid3 YamlMotion(const YAML::Node& node, const std::string& path, const std::string& key);

}  // namespace oaslam
