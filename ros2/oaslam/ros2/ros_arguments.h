#pragma once

#include <map>
#include <string>
#include <vector>

namespace oaslam {

// What a node of ROS is told on its command line besides its own options: image:=/camera/image_raw,
// also behind `--ros-args -r`.
struct RosArguments {
  std::map<std::string, std::string> names;  // of a topic, __ns or __node: what it is called
  std::vector<std::string> others;           // the rest, in its order
  std::vector<std::string> ignored;          // parameters of --ros-args

  // The topic that a name of the node stands for, such as "image" or "~/pose" (below the name of
  // the node), in the namespace of the node. "/tf" stays as it is.
  std::string TopicOf(const std::string& name) const;
};

// `known`: the names of the node's topics. Throws InputError for another one, and for a value that
// is no topic.
RosArguments ParseRosArguments(const std::vector<std::string>& arguments,
                               const std::vector<std::string>& known);

}  // namespace oaslam
