#include "oaslam/exports/result_topics.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "oaslam/exports/map_scene.h"
#include "oaslam/recordings/cdr_writer.h"

namespace oaslam {
namespace {

constexpr char kMapFrame[] = "map";

// Nanoseconds; what a stamp of ROS cannot tell becomes the nearest that it can.
int64_t NanosecondsOf(double seconds) {
  constexpr double kLatest = INT32_MAX;
  const double within = std::clamp(std::isfinite(seconds) ? seconds : 0, 0.0, kLatest);
  const double whole = std::floor(within);
  return static_cast<int64_t>(whole) * 1'000'000'000 + std::llround((within - whole) * 1e9);
}

CdrWriter& Stamp(CdrWriter& out, double time) {
  constexpr int64_t kSecond = 1'000'000'000;
  const int64_t stamp = NanosecondsOf(time);
  return out.Put(static_cast<int32_t>(stamp / kSecond)).Put(static_cast<uint32_t>(stamp % kSecond));
}
CdrWriter& Header(CdrWriter& out, double time, std::string_view frame) {
  return Stamp(out, time).Text(frame);
}
// A position or translation, and a rotation.
CdrWriter& Pose(CdrWriter& out, const Rigid3& pose) {
  const Rigid3::Rotation& q = pose.rotation;
  return out.Vector(pose.translation).Put(q.x()).Put(q.y()).Put(q.z()).Put(q.w());
}
CdrWriter& Color(CdrWriter& out, const Rgb& color, float opacity) {
  for (const unsigned char channel : color) out.Put(static_cast<float>(channel) / 255);
  return out.Put(opacity);
}

// Row by row, as ROS has them: position, then rotation about the fixed axes.
using Covariance = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
CdrWriter& Put(CdrWriter& out, const Covariance& covariance) {
  return out.All(std::span(covariance.data(), 36));
}

// ROS has both parts of the covariance in the axes of the map, OA-SLAM in those of the camera.
Covariance InAxesOf(const Rigid3& map_from_cam, const PoseCovariance& covariance) {
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() =
      map_from_cam.rotation.toRotationMatrix();
  return turn * covariance * turn.transpose();
}

// Position and turn about the vertical are uncertain.
Covariance CovarianceOf(const Object& object, const Rigid3& map_from_world) {
  const Eigen::Matrix3d turn = map_from_world.rotation.toRotationMatrix();
  Covariance covariance = Covariance::Zero();
  covariance.topLeftCorner<3, 3>() =
      turn * object.covariance.topLeftCorner<3, 3>() * turn.transpose();
  covariance.topRightCorner<3, 1>() = turn * object.covariance.topRightCorner<3, 1>();
  covariance.bottomLeftCorner<1, 3>() = covariance.topRightCorner<3, 1>().transpose();
  covariance(5, 5) = object.covariance(6, 6);
  return covariance;
}

std::string LabelOf(const Object& object, const ClassNames& names) {
  return object.name.empty() ? NameOf(names, object.category_id) : object.name;
}

double ShareOfCategory(const Object& object) {
  double found = 0;
  ForEachLabel(LabelsOf(object), [&](int category, double share) {
    if (category == object.category_id) found = share;
  });
  return found;
}

template <typename Visit>
void ForEachMapped(const Map& map, Visit visit) {
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state == ObjectState::kMapped) visit(id, object);
  });
}

// visualization_msgs/Marker.
struct Marker {
  enum Type : int32_t { kSphere = 2, kText = 9 };
  enum Action : int32_t { kAdd = 0, kDeleteAll = 3 };
  std::string space{};
  int32_t id = 0;
  Type type = kSphere;
  Action action = kAdd;
  Rigid3 pose{};
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  Rgb color{};
  float opacity = 1;
  std::string text{};
};

void Put(CdrWriter& out, double time, const Marker& marker) {
  Header(out, time, kMapFrame).Text(marker.space).Put(marker.id);
  out.Put(int32_t{marker.type}).Put(int32_t{marker.action});
  Color(Pose(out, marker.pose).Vector(marker.scale), marker.color, marker.opacity);
  out.Put(int32_t{0}).Put(uint32_t{0});   // it stays until it is deleted
  out.Put(uint8_t{0}).Count(0).Count(0);  // not locked to the frame; no points, no colours
  Header(out.Text(""), 0, "").Text("").Count(0).Count(0);            // no texture
  out.Text(marker.text).Text("").Text("").Count(0).Put(uint8_t{0});  // no mesh
}

}  // namespace

Rigid3::Rotation RosFromWorld(const Map& map) {
  const Eigen::Matrix3d rows = ZUpFromWorld(map);  // right, forward, up
  Eigen::Matrix3d turned;
  turned << rows.row(1), -rows.row(0), rows.row(2);
  return Rigid3::Rotation(turned);
}

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
  CdrWriter out;
  Pose(Header(out.Count(1), time, kMapFrame).Text(frame), map_from_world_ * world_from_cam);
  file_.Write(transforms_, NanosecondsOf(time), out.bytes());
}

void ResultTopics::AddPose(double time, const Rigid3& world_from_cam,
                           const PoseCovariance& covariance) {
  const Rigid3 map_from_cam = map_from_world_ * world_from_cam;
  CdrWriter out;
  Put(Pose(Header(out, time, kMapFrame), map_from_cam), InAxesOf(map_from_cam, covariance));
  file_.Write(pose_, NanosecondsOf(time), out.bytes());
}

void ResultTopics::AddPath(double time, uint16_t topic, const std::vector<StampedPose>& poses) {
  CdrWriter out;
  Header(out, time, kMapFrame).Count(poses.size());
  for (const StampedPose& pose : poses)
    Pose(Header(out, pose.timestamp, kMapFrame), map_from_world_ * pose.world_from_cam);
  file_.Write(topic, NanosecondsOf(time), out.bytes());
}

void ResultTopics::AddMap(double time, const Map& map, const ClassNames& names) {
  AddLandmarks(time, map);
  AddMarkers(time, map, names);
  AddObjects(time, map, names);
}

void ResultTopics::AddLandmarks(double time, const Map& map) {
  constexpr uint8_t kFloat32 = 7;
  constexpr uint32_t kPointBytes = 12;
  std::vector<std::array<float, 3>> points;
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    const Eigen::Vector3f x = (map_from_world_ * landmark.position).cast<float>();
    points.push_back({x.x(), x.y(), x.z()});
  });
  CdrWriter out;
  Header(out, time, kMapFrame).Put(uint32_t{1}).Count(points.size()).Count(3);
  uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    out.Text(name).Put(offset).Put(kFloat32).Put(uint32_t{1});
    offset += sizeof(float);
  }
  constexpr uint8_t kIsBigEndian = 0, kIsDense = 1;
  out.Put(kIsBigEndian).Put(kPointBytes).Put(static_cast<uint32_t>(kPointBytes * points.size()));
  out.Bytes({reinterpret_cast<const uint8_t*>(points.data()), kPointBytes * points.size()});
  out.Put(kIsDense);
  file_.Write(landmarks_, NanosecondsOf(time), out.bytes());
}

// All markers are drawn anew, since objects also vanish.
void ResultTopics::AddMarkers(double time, const Map& map, const ClassNames& names) {
  constexpr float kOpacity = 0.5F;
  constexpr double kTextSize = 0.5;  // of the mean half axis
  std::vector<Marker> markers{{.action = Marker::kDeleteAll}};
  ForEachMapped(map, [&](ObjectId id, const Object& object) {
    const Ellipsoid& shape = object.ellipsoid;
    Marker marker{.space = "objects",
                  .id = static_cast<int32_t>(id.value),
                  .pose = map_from_world_ * Rigid3(shape.rotation, shape.center),
                  .scale = 2 * shape.half_axes,
                  .color = PaletteColor(static_cast<size_t>(std::max(object.category_id, 0))),
                  .opacity = kOpacity};
    markers.push_back(marker);
    marker.space = "labels";
    marker.type = Marker::kText;
    marker.pose.translation.z() += shape.half_axes.maxCoeff();
    marker.scale.setConstant(kTextSize * shape.half_axes.mean());
    marker.opacity = 1;
    marker.text = LabelOf(object, names);
    markers.push_back(marker);
  });
  CdrWriter out;
  out.Count(markers.size());
  for (const Marker& marker : markers) Put(out, time, marker);
  file_.Write(markers_, NanosecondsOf(time), out.bytes());
}

void ResultTopics::AddObjects(double time, const Map& map, const ClassNames& names) {
  CdrWriter out;
  Header(out, time, kMapFrame).Count(static_cast<size_t>(map.CountMappedObjects()));
  ForEachMapped(map, [&](ObjectId id, const Object& object) {
    const Ellipsoid& shape = object.ellipsoid;
    const Rigid3 pose = map_from_world_ * Rigid3(shape.rotation, shape.center);
    Header(out, time, kMapFrame).Count(1).Text(NameOf(names, object.category_id));
    Put(Pose(out.Put(ShareOfCategory(object)), pose), CovarianceOf(object, map_from_world_));
    Pose(out, pose).Vector(2 * shape.half_axes).Text(ToString(id));
  });
  file_.Write(objects_, NanosecondsOf(time), out.bytes());
}

void ResultTopics::AddPicture(double time, const cv::Mat& picture, const Camera& camera) {
  constexpr int kQuality = 85;  // of JPEG: no blocks are seen, at half the size of OpenCV's 95
  ByteBuffer bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  CdrWriter image;
  Header(image, time, kCameraFrame).Text("jpeg").Bytes(bytes);
  file_.Write(image_, NanosecondsOf(time), image.bytes());

  const Camera& c = camera;
  CdrWriter info;
  Header(info, time, kCameraFrame).Count(static_cast<size_t>(picture.rows));
  info.Count(static_cast<size_t>(picture.cols)).Text("plumb_bob");
  info.Count(5).All(std::array<double, 5>{});
  info.All(std::array{c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0});
  info.All(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  info.All(std::array{c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  info.All(std::array<uint32_t, 6>{}).Put(uint8_t{0});  // neither binning nor a region of interest
  file_.Write(camera_, NanosecondsOf(time), info.bytes());
}

void ResultTopics::AddDetections(double time, const std::vector<Detection>& detections,
                                 const ClassNames& names) {
  CdrWriter out;
  Header(out, time, kCameraFrame).Count(detections.size());
  for (const Detection& detection : detections) {
    const Box& box = detection.box;
    Header(out, time, kCameraFrame).Count(1).Text(NameOf(names, detection.category_id));
    Put(Pose(out.Put(detection.score), {}), Covariance::Zero());  // not known
    constexpr double kTurn = 0;
    out.Put(box.Center().x()).Put(box.Center().y()).Put(kTurn);
    out.Put(box.Width()).Put(box.Height()).Text("");
  }
  file_.Write(detections_, NanosecondsOf(time), out.bytes());
}

void ResultTopics::AddEvent(double time, bool is_warning, const std::string& text) {
  constexpr uint8_t kInfo = 20, kWarning = 30;
  CdrWriter out;
  Stamp(out, time).Put(is_warning ? kWarning : kInfo).Text("oaslam").Text(text);
  out.Text("").Text("").Put(uint32_t{0});  // no place in a source
  file_.Write(events_, NanosecondsOf(time), out.bytes());
}

}  // namespace oaslam
