#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "oaslam/error.h"
#include "oaslam/images/camera_source.h"
#include "program.h"
#include "robot_view.h"

namespace oaslam::apps {
namespace {

constexpr const char* kOverview =
    R"(oaslam-ros2: OA-SLAM on the camera of a robot, among the nodes of ROS 2

Map, and tell where the robot is:  oaslam-ros2 image:=/camera/image_raw --out lab
In that map another day:           oaslam-ros2 image:=/camera/image_raw --map-in lab/map.oaslam --read-only --out today
Watch it in a browser:             oaslam-ros2 image:=/camera/image_raw --viewer

oaslam-ros2 --help lists the options; docs/robots.md the topics and frames.
)";

// `oaslam run ros2:TOPIC` with what the topics and the other arguments are.
int RunRobot(int argc, char** argv) {
  RosArguments ros;
  try {
    ros = ParseRosArguments({argv + 1, argv + argc}, RobotNode::TopicNames());
  } catch (const InputError& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
  if (!ros.ignored.empty())
    fmt::print(stderr, "not used: {} (stamps are those of the images in any case)\n",
               fmt::join(ros.ignored, " "));
  std::vector<std::string> arguments = {argv[0]};
  if (argc > 1 && ros.others != std::vector<std::string>{"--version"})
    arguments.insert(arguments.end(), {"run", RobotView::kScheme + ros.TopicOf("image")});
  arguments.insert(arguments.end(), ros.others.begin(), ros.others.end());
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());

  const auto view = std::make_shared<RobotView>(ros);
  AddCameraScheme(RobotView::kScheme,
                  [robot = view.get()](const std::string&, const ImageSourceOptions& options) {
                    return robot->OpenImages(options);
                  });
  const std::string port = std::to_string(view->PortIfLeftOut());
  CLI::App app{"OA-SLAM on the camera of a robot, among the nodes of ROS 2"};
  AddRunCommand(app, view);
  app.get_subcommand("run")->description(
      fmt::format("SLAM on the camera of a robot, among the nodes of ROS 2:\n"
                  "  oaslam-ros2 [NAME:=/topic ...] [OPTIONS]\n"
                  "NAME: {}\nThe other options are those of `oaslam run`:",
                  fmt::join(RobotNode::TopicNames(), ", ")));
  return RunProgram(app, kOverview, static_cast<int>(pointers.size()), pointers.data(),
                    {{"--follow", "0"}, {"--viewer", port}});
}

}  // namespace
}  // namespace oaslam::apps

int main(int argc, char** argv) { return oaslam::apps::RunRobot(argc, argv); }
