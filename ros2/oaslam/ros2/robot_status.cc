#include "oaslam/ros2/robot_status.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <set>

namespace oaslam {
namespace {

constexpr char kRemedy[] = "sudo sysctl -w net.core.rmem_max=4194304, or take compressed images";
constexpr double kSilence = 2;  // seconds without an image that are said

bool HasImages(const Publication& publication) {
  return publication.type == "sensor_msgs/Image" ||
         publication.type == "sensor_msgs/CompressedImage";
}

std::string TopicsOfImages(const RobotStatus& status) {
  std::set<std::string> found;
  for (const Publication& p : status.publications)
    if (HasImages(p)) found.insert(fmt::format("{} ({})", p.topic, p.type));
  if (!found.empty())
    return fmt::format("topics of images: {}; image:=TOPIC takes another", fmt::join(found, ", "));
  return status.publications.empty()
             ? "nobody else publishes anything that is seen here: ROS_DOMAIN_ID, network, firewall?"
             : fmt::format("none of the {} publishers seen has images", status.publications.size());
}

std::string WhyNoPose(const RobotStatus& status) {
  using Known = RobotStatus::Known;
  const std::string result =
      fmt::format("no {} -> {}, and poses are those of ", status.map, status.odom);
  if (!status.is_metric)
    return fmt::format(
        "{}the camera: the unit is not the metre (a map in metres, an IMU or detected objects tell "
        "it)",
        result);
  if (status.base_from_camera == Known::kNot)
    return fmt::format("{}the camera: /tf_static does not connect {} with {}", result, status.base,
                       status.camera);
  if (status.base_from_camera == Known::kAtOtherTimes)
    return fmt::format("no poses: /tf does not tell {} -> {} at the times of the images",
                       status.base, status.camera);
  if (status.odom_from_base == Known::kNot)
    return fmt::format("{}{}: nobody publishes {} -> {}", result, status.base, status.odom,
                       status.base);
  if (status.odom_from_base == Known::kAtOtherTimes)
    return fmt::format(
        "no {} -> {}: {} -> {} is not known at the times of the images: other clock?", status.map,
        status.odom, status.odom, status.base);
  return "";
}

}  // namespace

std::vector<std::string> ProblemsOf(const RobotStatus& status) {
  std::vector<std::string> problems;
  const auto add = [&](bool is_so, std::string text) {
    if (is_so) problems.push_back(std::move(text));
  };
  const bool has_images = status.silence_s && *status.silence_s < kSilence;
  add(!has_images && status.publishers == 0,
      fmt::format("nobody publishes images on {}; {}", status.image_topic, TopicsOfImages(status)));
  add(!has_images && status.publishers > 0,
      fmt::format("{} has a publisher, but no image has come{}; if all are lost on the way: {}",
                  status.image_topic,
                  status.silence_s ? fmt::format(" for {:.0f} s", *status.silence_s) : "",
                  kRemedy));
  add(status.publishers > 1, fmt::format("{} has {} publishers: the images of the first are taken",
                                         status.image_topic, status.publishers));
  add(status.without_stamp > 0,
      fmt::format("{} images have no time stamp (0) and are left out: the driver of the camera "
                  "must set it",
                  status.without_stamp));
  constexpr int kFew = 10, kShare = 20;  // images; one of so many
  add(status.out_of_order >= kFew && status.out_of_order * kShare > status.images,
      fmt::format("{} images are not later than the one before and are left out",
                  status.out_of_order));
  add(status.missed >= kFew && status.missed * kShare > status.images,
      fmt::format("{} images did not arrive beside {} that did: {}", status.missed, status.images,
                  kRemedy));
  constexpr int kEnough = 30;  // messages
  add(has_images && status.recent_infos >= kEnough &&
          2 * status.recent_images < status.recent_infos,
      fmt::format("{} images came with {} CameraInfos: unless they are throttled, most are lost on "
                  "the way: {}",
                  status.recent_images, status.recent_infos, kRemedy));
  add(status.unreadable > 0,
      fmt::format("{} images cannot be read and are left out", status.unreadable));
  add(!status.imu_problem.empty(), "IMU: " + status.imu_problem);
  add(!status.has_optical_axes,
      fmt::format("{} of the images has the axes of {}: all will be turned by 90 degrees; images "
                  "need an optical frame, z forward",
                  status.camera, status.base));
  add(status.wants_camera_tf && status.camera_has_parent,
      fmt::format("{} -> {} is not published: {} has a parent already", status.map, status.camera,
                  status.camera));
  if (const std::string why =
          has_images && status.has_result && !status.wants_camera_tf ? WhyNoPose(status) : "";
      !why.empty())
    problems.push_back(why);
  return problems;
}

Diagnostic DiagnosticOf(const RobotStatus& status) {
  const std::vector<std::string> problems = ProblemsOf(status);
  const bool has_images = status.silence_s && *status.silence_s < kSilence;
  Diagnostic found{.name = "oaslam: localization"};
  found.level = !has_images                           ? Diagnostic::kError
                : status.has_pose && problems.empty() ? Diagnostic::kOk
                                                      : Diagnostic::kWarning;
  found.message = fmt::format("{}{}{}", has_images ? status.state : "no images",
                              problems.empty() ? "" : "; ", fmt::join(problems, "; "));
  const auto number = [](int value) { return std::to_string(value); };
  found.values = {{"state", status.state},
                  {"unit", status.is_metric ? "metre" : "arbitrary"},
                  {"map", status.is_mapping ? "extended" : "read-only"},
                  {"image topic", status.image_topic},
                  {"publishers", number(status.publishers)},
                  {"camera frame", status.camera},
                  {"images", number(status.images)},
                  {"images that did not arrive", number(status.missed)},
                  {"images without a time stamp", number(status.without_stamp)},
                  {"images out of order", number(status.out_of_order)},
                  {"images that cannot be read", number(status.unreadable)},
                  {"times the clock went back", number(status.clock_jumps)},
                  {"seconds since the last image",
                   status.silence_s ? fmt::format("{:.1f}", *status.silence_s) : "none yet"}};
  return found;
}

}  // namespace oaslam
