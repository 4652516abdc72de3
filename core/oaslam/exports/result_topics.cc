#include "oaslam/exports/result_topics.h"

#include "oaslam/exports/result_messages.h"

namespace oaslam {
namespace {

MessageHeader InMap(double time) { return {NanosecondsOf(time), "map"}; }
MessageHeader InCamera(double time) { return {NanosecondsOf(time), kCameraFrame}; }

}  // namespace

ResultTopics::ResultTopics(const std::string& path, const std::string& name)
    : file_(path, name),
      transforms_(file_.AddTopic("/tf", "tf2_msgs/TFMessage")),
      pose_(file_.AddTopic("/oaslam/pose", "geometry_msgs/PoseWithCovarianceStamped")),
      landmarks_(file_.AddTopic("/oaslam/landmarks", "sensor_msgs/PointCloud2")),
      markers_(file_.AddTopic("/oaslam/objects", "visualization_msgs/MarkerArray")),
      objects_(file_.AddTopic("/oaslam/objects_3d", "vision_msgs/Detection3DArray")),
      image_(file_.AddTopic("/oaslam/image/compressed", "sensor_msgs/CompressedImage")),
      camera_(file_.AddTopic("/oaslam/camera_info", "sensor_msgs/CameraInfo")),
      detections_(file_.AddTopic("/oaslam/detections", "vision_msgs/Detection2DArray")),
      events_(file_.AddTopic("/oaslam/events", "rcl_interfaces/Log")) {}

void ResultTopics::AddTransform(double time, const std::string& frame,
                                const Rigid3& world_from_cam) {
  const MessageHeader header = InMap(time);
  file_.Write(transforms_, header.stamp,
              TransformMessage(header, frame, map_from_world_ * world_from_cam).bytes());
}

void ResultTopics::AddPose(double time, const Rigid3& world_from_cam,
                           const PoseCovariance& covariance) {
  const MessageHeader header = InMap(time);
  const Rigid3 map_from_cam = map_from_world_ * world_from_cam;
  file_.Write(pose_, header.stamp,
              PoseMessage(header, map_from_cam, InAxesOf(map_from_cam, covariance)).bytes());
}

void ResultTopics::AddPath(double time, uint16_t topic, const std::vector<StampedPose>& poses) {
  const MessageHeader header = InMap(time);
  file_.Write(topic, header.stamp, PathMessage(header, poses, map_from_world_).bytes());
}

void ResultTopics::AddMap(double time, const Map& map, const ClassNames& names) {
  const MessageHeader header = InMap(time);
  const auto write = [&](uint16_t topic, const CdrWriter& message) {
    file_.Write(topic, header.stamp, message.bytes());
  };
  write(landmarks_, LandmarksMessage(header, map, map_from_world_));
  write(markers_, MarkersMessage(header, map, names, map_from_world_));
  write(objects_, ObjectsMessage(header, map, names, map_from_world_));
}

void ResultTopics::AddPicture(double time, const cv::Mat& picture, const Camera& camera) {
  const MessageHeader header = InCamera(time);
  file_.Write(image_, header.stamp, PictureMessage(header, picture).bytes());
  file_.Write(camera_, header.stamp, CameraInfoMessage(header, picture.size(), camera).bytes());
}

void ResultTopics::AddDetections(double time, const std::vector<Detection>& detections,
                                 const ClassNames& names) {
  const MessageHeader header = InCamera(time);
  file_.Write(detections_, header.stamp, DetectionsMessage(header, detections, names).bytes());
}

void ResultTopics::AddEvent(double time, bool is_warning, const std::string& text) {
  const int64_t stamp = NanosecondsOf(time);
  file_.Write(events_, stamp, EventMessage(stamp, is_warning, text).bytes());
}

}  // namespace oaslam
