#pragma once

#include <string>

namespace oaslam {

// The definition of a message of ROS 2 that is written, such as "nav_msgs/Path", and behind it the
// definitions of all messages that it has in it, as rosbag2 stores them (ros2msg). Constants, which
// are not part of a message, are left out.
std::string RosDefinition(const std::string& type);

}  // namespace oaslam
