// A ROS 1 node around Slam.
//   subscribes   image (sensor_msgs/Image: mono8, bgr8, rgb8), camera_info (sensor_msgs/CameraInfo)
//   publishes    state (std_msgs/String, for each image), pose (geometry_msgs/PoseStamped) and tf:
//   the camera's optical frame
//                in ~map_frame; objects (visualization_msgs/MarkerArray), once a second
//   parameters   ~map_frame (map), ~mode (live; lockstep, sequential), ~detector (default; a file,
//   or empty: none),
//                ~map_in, ~map_out (map files; empty: none)
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/CameraInfo.h>
#include <sensor_msgs/Image.h>
#include <std_msgs/String.h>
#include <tf2_ros/transform_broadcaster.h>
#include <visualization_msgs/MarkerArray.h>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>

#include "tracker.h"

namespace {

CameraInfo CameraOf(const sensor_msgs::CameraInfo& info) {
  CameraInfo camera;
  camera.width = static_cast<int>(info.width);
  camera.height = static_cast<int>(info.height);
  camera.fx = info.K[0];
  camera.fy = info.K[4];
  camera.cx = info.K[2];
  camera.cy = info.K[5];
  camera.distortion_model = info.distortion_model;
  camera.distortion = info.D;
  return camera;
}

// Grey and BGR images are read where they are.
cv::Mat ImageOf(const sensor_msgs::Image& message) {
  const bool is_grey = message.encoding == "mono8";
  if (!is_grey && message.encoding != "bgr8" && message.encoding != "rgb8")
    throw std::runtime_error("image: encoding \"" + message.encoding +
                             "\", allowed: mono8, bgr8, rgb8");
  const size_t row = message.width * (is_grey ? 1u : 3u);
  if (message.step < row || message.data.size() < size_t{message.step} * message.height)
    throw std::runtime_error("image: data shorter than its size says");
  const cv::Mat image(static_cast<int>(message.height), static_cast<int>(message.width),
                      is_grey ? CV_8UC1 : CV_8UC3, const_cast<uint8_t*>(message.data.data()),
                      message.step);
  if (message.encoding != "rgb8") return image;
  cv::Mat bgr;
  cv::cvtColor(image, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

geometry_msgs::Pose MessageOf(const Pose& pose) {
  geometry_msgs::Pose message;
  message.position.x = pose.position.x();
  message.position.y = pose.position.y();
  message.position.z = pose.position.z();
  message.orientation.x = pose.rotation.x();
  message.orientation.y = pose.rotation.y();
  message.orientation.z = pose.rotation.z();
  message.orientation.w = pose.rotation.w();
  return message;
}

class Node {
 public:
  Node() {
    options_.mode = private_.param<std::string>("mode", "live");
    options_.detector = private_.param<std::string>("detector", "default");
    options_.map_in = private_.param<std::string>("map_in", "");
    map_frame_ = private_.param<std::string>("map_frame", "map");
    state_ = node_.advertise<std_msgs::String>("state", 10);
    pose_ = node_.advertise<geometry_msgs::PoseStamped>("pose", 10);
    objects_ = node_.advertise<visualization_msgs::MarkerArray>("objects", 1, true);
    // Only the newest image waits: a slow machine misses images, but never falls behind.
    camera_ = node_.subscribe("camera_info", 1, &Node::OnCamera, this);
    image_ = node_.subscribe("image", 1, &Node::OnImage, this);
  }

  void Finish() {
    const auto map_out = private_.param<std::string>("map_out", "");
    if (tracker_ && !map_out.empty()) tracker_->Save(map_out);
  }

 private:
  void OnCamera(const sensor_msgs::CameraInfo& info) {
    if (!tracker_) tracker_ = std::make_unique<Tracker>(options_, CameraOf(info));
  }

  void OnImage(const sensor_msgs::Image& message) {
    if (!tracker_) return;  // the camera is not known yet
    try {
      const Tracked tracked = tracker_->Track(ImageOf(message), message.header.stamp.toSec());
      if (tracked.world_from_cam) PublishPose(message.header, *tracked.world_from_cam);
      PublishObjects(message.header.stamp);
      std_msgs::String state;
      state.data = tracked.state;
      state_.publish(state);
    } catch (const std::runtime_error& error) {
      ROS_WARN_THROTTLE(1, "%s", error.what());
    }
  }

  void PublishPose(const std_msgs::Header& header, const Pose& world_from_cam) {
    geometry_msgs::PoseStamped pose;
    pose.header.stamp = header.stamp;
    pose.header.frame_id = map_frame_;
    pose.pose = MessageOf(world_from_cam);
    pose_.publish(pose);
    geometry_msgs::TransformStamped transform;
    transform.header = pose.header;
    transform.child_frame_id = header.frame_id;
    transform.transform.rotation = pose.pose.orientation;
    transform.transform.translation.x = pose.pose.position.x;
    transform.transform.translation.y = pose.pose.position.y;
    transform.transform.translation.z = pose.pose.position.z;
    transforms_.sendTransform(transform);
  }

  void PublishObjects(const ros::Time& now) {
    if (now >= objects_time_ && now - objects_time_ < ros::Duration(1)) return;
    objects_time_ = now;
    visualization_msgs::MarkerArray markers;
    markers.markers.resize(1);
    markers.markers[0].action = visualization_msgs::Marker::DELETEALL;
    for (const Thing& thing : tracker_->Things()) {
      visualization_msgs::Marker marker;
      marker.header.stamp = now;
      marker.header.frame_id = map_frame_;
      marker.ns = thing.name;
      marker.id = static_cast<int>(thing.id);
      marker.type = visualization_msgs::Marker::SPHERE;
      marker.pose = MessageOf(thing.world_from_thing);
      marker.scale.x = thing.size.x();
      marker.scale.y = thing.size.y();
      marker.scale.z = thing.size.z();
      marker.color.g = 0.8f;
      marker.color.a = 0.5f;
      markers.markers.push_back(marker);
    }
    objects_.publish(markers);
  }

  ros::NodeHandle node_, private_{"~"};
  TrackerOptions options_;
  std::string map_frame_;
  std::unique_ptr<Tracker> tracker_;
  ros::Publisher state_, pose_, objects_;
  ros::Subscriber camera_, image_;
  tf2_ros::TransformBroadcaster transforms_;
  ros::Time objects_time_;
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "oaslam");
  try {
    Node node;
    ros::spin();
    node.Finish();
  } catch (const std::exception& error) {
    ROS_ERROR("%s", error.what());
    return 1;
  }
}
