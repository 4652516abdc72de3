// A ROS 1 node: images and their camera_info in; pose, tf and objects out (docs/integrate.md).
#include <geometry_msgs/PoseStamped.h>
#include <ros/ros.h>
#include <std_msgs/String.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <optional>
#include <string>

#include "messages.h"

namespace {

class Node {
 public:
  // Images that come while one is tracked wait in the queue of their topic: the newest only.
  Node()
      : info_topic_(node_.subscribe("camera_info", 1, &Node::OnCamera, this)),
        image_topic_(node_.subscribe("image", 1, &Node::OnImage, this)) {}

  // Optimises and saves the map, if the parameter `save` says so.
  void Save() {
    if (tracker_ && !save_.empty()) tracker_->Save(save_);
  }

 private:
  void OnCamera(const sensor_msgs::CameraInfo& info) {
    Settings settings;
    settings.config = private_.param<std::string>("config", "");
    settings.detector = private_.param<std::string>("detector", "default");
    if (settings.detector == "none") settings.detector.clear();
    settings.map = private_.param<std::string>("map", "");
    settings.mapping = private_.param("mapping", true);
    tracker_.emplace(settings, LensOf(info));
    info_topic_.shutdown();
  }

  void OnImage(const sensor_msgs::ImageConstPtr& message) {
    if (!tracker_) return PublishState("no camera_info");
    const Answer answer = tracker_->Track(ImageOf(*message), message->header.stamp.toSec());
    if (!answer.problem.empty()) {
      ROS_ERROR_THROTTLE(1, "%s", answer.problem.c_str());
      return;
    }
    if (answer.is_another_map) ROS_WARN("a new map begins: poses are in its frame from now on");
    if (answer.map_from_cam) PublishPose(*answer.map_from_cam, message->header);
    if (const auto objects = tracker_->ObjectsIfNew()) {
      objects_.publish(MarkersOf(*objects, InMap(message->header.stamp)));
      if (!tracker_->IsMetric()) ROS_WARN_ONCE("the unit of the map is not the metre");
    }
    PublishState(answer.state);
  }

  void PublishState(const std::string& text) {
    std_msgs::String state;
    state.data = text;
    states_.publish(state);
  }

  void PublishPose(const Eigen::Isometry3d& map_from_cam, const std_msgs::Header& image) {
    geometry_msgs::PoseStamped pose;
    pose.header = InMap(image.stamp);
    pose.pose = PoseOf(map_from_cam);
    poses_.publish(pose);

    geometry_msgs::TransformStamped transform;
    transform.header = pose.header;
    transform.child_frame_id = child_frame_.empty() ? image.frame_id : child_frame_;
    try {
      const auto cam_from_child =
          known_.lookupTransform(image.frame_id, transform.child_frame_id, image.stamp);
      transform.transform = TransformOf(map_from_cam * MotionOf(cam_from_child.transform));
      tf_.sendTransform(transform);
    } catch (const tf2::TransformException& error) {
      ROS_WARN_THROTTLE(1, "no tf: %s", error.what());
    }
  }

  std_msgs::Header InMap(const ros::Time& stamp) const {
    std_msgs::Header header;
    header.stamp = stamp;
    header.frame_id = map_frame_;
    return header;
  }

  ros::NodeHandle node_, private_{"~"};
  const std::string save_ = private_.param<std::string>("save", "");
  const std::string map_frame_ = private_.param<std::string>("map_frame", "map");
  const std::string child_frame_ = private_.param<std::string>("child_frame", "");
  std::optional<Tracker> tracker_;  // from the first camera_info on
  tf2_ros::Buffer known_;
  tf2_ros::TransformListener listener_{known_};
  tf2_ros::TransformBroadcaster tf_;
  ros::Publisher poses_ = node_.advertise<geometry_msgs::PoseStamped>("pose", 10);
  ros::Publisher objects_ = node_.advertise<visualization_msgs::MarkerArray>("objects", 1, true);
  ros::Publisher states_ = node_.advertise<std_msgs::String>("state", 10);
  ros::Subscriber info_topic_, image_topic_;
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "oaslam");
  try {
    Node node;
    int status = 0;
    try {
      ros::spin();
    } catch (const std::runtime_error& error) {
      ROS_FATAL("%s", error.what());  // the map so far can be saved
      status = 1;
    }
    node.Save();
    return status;
  } catch (const std::exception& error) {
    ROS_FATAL("%s", error.what());
    return 1;
  }
}
