#include "oaslam/ros2/ros_arguments.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <regex>

#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// "pose" of "~/pose", "tf" of "/tf".
std::string Plain(const std::string& name) {
  return name.substr(std::min(name.find_first_not_of("~/"), name.size()));
}

}  // namespace

std::string RosArguments::TopicOf(const std::string& name) const {
  const auto find = [&](const std::string& key, const std::string& otherwise) {
    const auto found = names.find(key);
    return found == names.end() ? otherwise : found->second;
  };
  const std::string node = find("__node", "oaslam"), space = Plain(find("__ns", ""));
  const std::string prefix = space.empty() ? "/" : "/" + space + "/";
  std::string topic = find(Plain(name), name);
  if (topic.starts_with('~')) topic = node + topic.substr(1);
  return topic.starts_with('/') ? topic : prefix + topic;
}

RosArguments ParseRosArguments(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& known) {
  static const std::regex rule("([~/]*[A-Za-z0-9_]+):=(.*)"), topic("[~/]?[A-Za-z0-9_/]+");
  RosArguments found;
  bool is_ros = false;  // between --ros-args and --
  for (size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    std::smatch parts;
    if (argument == "--ros-args" || (is_ros && argument == "--")) {
      is_ros = argument == "--ros-args";
    } else if (is_ros && (argument == "-r" || argument == "--remap")) {
      continue;  // the rule comes next
    } else if (is_ros && (argument == "-p" || argument == "--param") && i + 1 < arguments.size()) {
      found.ignored.push_back(arguments[++i]);
    } else if (std::regex_match(argument, parts, rule)) {
      const std::string name = Plain(parts[1]);
      if (std::ranges::count(known, name) == 0 && name != "__ns" && name != "__node")
        throw BadInput("{}: no such name; the topics are {}", argument, fmt::join(known, ", "));
      if (!std::regex_match(parts[2].str(), topic))
        throw BadInput("{}: \"{}\" is no topic", argument, parts[2].str());
      found.names[name] = parts[2];
    } else if (is_ros) {
      found.ignored.push_back(argument);
    } else {
      found.others.push_back(argument);
    }
  }
  return found;
}

}  // namespace oaslam
