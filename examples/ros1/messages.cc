#include "messages.h"

#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

Lens LensOf(const sensor_msgs::CameraInfo& info) {
  const bool is_part = info.roi.width != 0 && info.roi.width != info.width;
  if (info.binning_x > 1 || info.binning_y > 1 || is_part)
    throw std::runtime_error("camera_info: binning and parts of images (roi) are not supported");
  const std::string& model = info.distortion_model;
  Lens lens;
  lens.is_equidistant = model == "equidistant";
  if (!lens.is_equidistant && model != "plumb_bob" && !model.empty())
    throw std::runtime_error("camera_info: distortion_model: " + model +
                             ", allowed: plumb_bob, equidistant");
  lens.distortion = info.D;
  if (lens.distortion.size() > (lens.is_equidistant ? 4 : 5))
    throw std::runtime_error("camera_info: D: " + std::to_string(info.D.size()) + " coefficients");
  lens.width = static_cast<int>(info.width);
  lens.height = static_cast<int>(info.height);
  lens.fx = info.K[0];
  lens.cx = info.K[2];
  lens.fy = info.K[4];
  lens.cy = info.K[5];
  return lens;
}

cv::Mat ImageOf(const sensor_msgs::Image& message) {
  const std::string& encoding = message.encoding;
  int channels = 3;
  if (encoding == "mono8")
    channels = 1;
  else if (encoding == "bgra8")
    channels = 4;
  else if (encoding != "bgr8" && encoding != "rgb8")
    throw std::runtime_error("image: encoding: " + encoding +
                             ", allowed: mono8, bgr8, rgb8, bgra8");
  const size_t step = message.step;
  if (step < size_t{message.width} * channels || message.data.size() < step * message.height)
    throw std::runtime_error("image: data: " + std::to_string(message.data.size()) +
                             " bytes are too few for its size");
  const cv::Mat view(static_cast<int>(message.height), static_cast<int>(message.width),
                     CV_8UC(channels), const_cast<uint8_t*>(message.data.data()), step);
  if (encoding != "rgb8") return view;
  cv::Mat bgr;
  cv::cvtColor(view, bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

geometry_msgs::Pose PoseOf(const Eigen::Isometry3d& pose) {
  const Eigen::Vector3d p = pose.translation();
  const Eigen::Quaterniond q(pose.linear());
  geometry_msgs::Pose message;
  message.position.x = p.x(), message.position.y = p.y(), message.position.z = p.z();
  message.orientation.x = q.x(), message.orientation.y = q.y(), message.orientation.z = q.z();
  message.orientation.w = q.w();
  return message;
}

geometry_msgs::Transform TransformOf(const Eigen::Isometry3d& motion) {
  const geometry_msgs::Pose pose = PoseOf(motion);
  geometry_msgs::Transform transform;
  transform.translation.x = pose.position.x;
  transform.translation.y = pose.position.y;
  transform.translation.z = pose.position.z;
  transform.rotation = pose.orientation;
  return transform;
}

Eigen::Isometry3d MotionOf(const geometry_msgs::Transform& transform) {
  const auto& t = transform.translation;
  const auto& q = transform.rotation;
  return Eigen::Translation3d(t.x, t.y, t.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z);
}

visualization_msgs::MarkerArray MarkersOf(const std::vector<MappedObject>& objects,
                                          const std_msgs::Header& header) {
  visualization_msgs::MarkerArray array;
  visualization_msgs::Marker marker;
  marker.header = header;
  marker.ns = "objects";
  marker.action = visualization_msgs::Marker::DELETEALL;
  marker.pose.orientation.w = 1;
  array.markers.push_back(marker);
  marker.action = visualization_msgs::Marker::ADD;
  marker.type = visualization_msgs::Marker::SPHERE;
  marker.color.r = 0.2f, marker.color.g = 0.8f, marker.color.b = 0.4f, marker.color.a = 0.5f;
  for (const MappedObject& object : objects) {
    marker.id = object.id;
    marker.text = object.name;
    marker.pose = PoseOf(object.map_from_object);
    marker.scale.x = 2 * object.half_axes.x();
    marker.scale.y = 2 * object.half_axes.y();
    marker.scale.z = 2 * object.half_axes.z();
    array.markers.push_back(marker);
  }
  return array;
}
