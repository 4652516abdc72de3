#include "oaslam/exports/result_messages.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <span>

#include "oaslam/exports/map_scene.h"

namespace oaslam {
namespace {

CdrWriter& Stamp(CdrWriter& out, int64_t stamp) {
  constexpr int64_t kSecond = 1'000'000'000;
  return out.Put(static_cast<int32_t>(stamp / kSecond)).Put(static_cast<uint32_t>(stamp % kSecond));
}
CdrWriter& Put(CdrWriter& out, const MessageHeader& header) {
  return Stamp(out, header.stamp).Text(header.frame);
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
CdrWriter& Put(CdrWriter& out, const RosCovariance& covariance) {
  return out.All(std::span(covariance.data(), 36));
}

// Position and turn about the vertical are uncertain.
RosCovariance CovarianceOf(const Object& object, const Rigid3& map_from_world) {
  const Eigen::Matrix3d turn = map_from_world.rotation.toRotationMatrix();
  RosCovariance covariance = RosCovariance::Zero();
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

void Put(CdrWriter& out, const MessageHeader& header, const Marker& marker) {
  Put(out, header).Text(marker.space).Put(marker.id);
  out.Put(int32_t{marker.type}).Put(int32_t{marker.action});
  Color(Pose(out, marker.pose).Vector(marker.scale), marker.color, marker.opacity);
  out.Put(int32_t{0}).Put(uint32_t{0});   // it stays until it is deleted
  out.Put(uint8_t{0}).Count(0).Count(0);  // not locked to the frame; no points, no colours
  Put(out.Text(""), MessageHeader{}).Text("").Count(0).Count(0);     // no texture
  out.Text(marker.text).Text("").Text("").Count(0).Put(uint8_t{0});  // no mesh
}

}  // namespace

int64_t NanosecondsOf(double seconds) {
  constexpr double kLatest = INT32_MAX;
  const double within = std::clamp(std::isfinite(seconds) ? seconds : 0, 0.0, kLatest);
  const double whole = std::floor(within);
  return static_cast<int64_t>(whole) * 1'000'000'000 + std::llround((within - whole) * 1e9);
}

RosCovariance InAxesOf(const Rigid3& map_from_cam, const PoseCovariance& covariance) {
  Eigen::Matrix<double, 6, 6> turn = Eigen::Matrix<double, 6, 6>::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() =
      map_from_cam.rotation.toRotationMatrix();
  return turn * covariance * turn.transpose();
}

CdrWriter TransformMessage(const MessageHeader& header, const std::string& child,
                           const Rigid3& pose) {
  CdrWriter out;
  Pose(Put(out.Count(1), header).Text(child), pose);
  return out;
}

CdrWriter PoseMessage(const MessageHeader& header, const Rigid3& pose,
                      const RosCovariance& covariance) {
  CdrWriter out;
  Put(Pose(Put(out, header), pose), covariance);
  return out;
}

CdrWriter OdometryMessage(const MessageHeader& header, const std::string& child, const Rigid3& pose,
                          const RosCovariance& covariance, const RosTwist& twist) {
  CdrWriter out;
  Put(Pose(Put(out, header).Text(child), pose), covariance);
  Put(out.Vector(twist.linear).Vector(twist.angular), twist.covariance);
  return out;
}

CdrWriter PathMessage(const MessageHeader& header, const std::vector<StampedPose>& poses,
                      const Rigid3& map_from_world) {
  CdrWriter out;
  Put(out, header).Count(poses.size());
  for (const StampedPose& pose : poses)
    Pose(Put(out, MessageHeader{NanosecondsOf(pose.timestamp), header.frame}),
         map_from_world * pose.world_from_cam);
  return out;
}

CdrWriter LandmarksMessage(const MessageHeader& header, const Map& map,
                           const Rigid3& map_from_world) {
  constexpr uint8_t kFloat32 = 7;
  constexpr uint32_t kPointBytes = 12;
  std::vector<std::array<float, 3>> points;
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    const Eigen::Vector3f x = (map_from_world * landmark.position).cast<float>();
    points.push_back({x.x(), x.y(), x.z()});
  });
  CdrWriter out;
  Put(out, header).Put(uint32_t{1}).Count(points.size()).Count(3);
  uint32_t offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    out.Text(name).Put(offset).Put(kFloat32).Put(uint32_t{1});
    offset += sizeof(float);
  }
  constexpr uint8_t kIsBigEndian = 0, kIsDense = 1;
  out.Put(kIsBigEndian).Put(kPointBytes).Put(static_cast<uint32_t>(kPointBytes * points.size()));
  out.Bytes({reinterpret_cast<const uint8_t*>(points.data()), kPointBytes * points.size()});
  out.Put(kIsDense);
  return out;
}

// All markers are drawn anew, since objects also vanish.
CdrWriter MarkersMessage(const MessageHeader& header, const Map& map, const ClassNames& names,
                         const Rigid3& map_from_world) {
  constexpr float kOpacity = 0.5F;
  constexpr double kTextSize = 0.5;  // of the mean half axis
  std::vector<Marker> markers{{.action = Marker::kDeleteAll}};
  ForEachMapped(map, [&](ObjectId id, const Object& object) {
    const Ellipsoid& shape = object.ellipsoid;
    Marker marker{.space = "objects",
                  .id = static_cast<int32_t>(id.value),
                  .pose = map_from_world * Rigid3(shape.rotation, shape.center),
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
  for (const Marker& marker : markers) Put(out, header, marker);
  return out;
}

CdrWriter ObjectsMessage(const MessageHeader& header, const Map& map, const ClassNames& names,
                         const Rigid3& map_from_world) {
  CdrWriter out;
  Put(out, header).Count(static_cast<size_t>(map.CountMappedObjects()));
  ForEachMapped(map, [&](ObjectId id, const Object& object) {
    const Ellipsoid& shape = object.ellipsoid;
    const Rigid3 pose = map_from_world * Rigid3(shape.rotation, shape.center);
    Put(out, header).Count(1).Text(NameOf(names, object.category_id));
    Put(Pose(out.Put(ShareOfCategory(object)), pose), CovarianceOf(object, map_from_world));
    Pose(out, pose).Vector(2 * shape.half_axes).Text(ToString(id));
  });
  return out;
}

CdrWriter EventMessage(int64_t stamp, bool is_warning, const std::string& text) {
  constexpr uint8_t kInfo = 20, kWarning = 30;
  CdrWriter out;
  Stamp(out, stamp).Put(is_warning ? kWarning : kInfo).Text("oaslam").Text(text);
  out.Text("").Text("").Put(uint32_t{0});  // no place in a source
  return out;
}

CdrWriter DetectionsMessage(const MessageHeader& header, const std::vector<Detection>& detections,
                            const ClassNames& names) {
  CdrWriter out;
  Put(out, header).Count(detections.size());
  for (const Detection& detection : detections) {
    const Box& box = detection.box;
    Put(out, header).Count(1).Text(NameOf(names, detection.category_id));
    Put(Pose(out.Put(detection.score), {}), RosCovariance::Zero());  // not known
    constexpr double kTurn = 0;
    out.Put(box.Center().x()).Put(box.Center().y()).Put(kTurn);
    out.Put(box.Width()).Put(box.Height()).Text("");
  }
  return out;
}

CdrWriter PictureMessage(const MessageHeader& header, const cv::Mat& picture) {
  constexpr int kQuality = 85;  // of JPEG: no blocks are seen, at half the size of OpenCV's 95
  ByteBuffer bytes;
  cv::imencode(".jpg", picture, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  CdrWriter out;
  Put(out, header).Text("jpeg").Bytes(bytes);
  return out;
}

CdrWriter CameraInfoMessage(const MessageHeader& header, const cv::Size& size, const Camera& c) {
  CdrWriter out;
  Put(out, header).Put(static_cast<uint32_t>(size.height));
  out.Put(static_cast<uint32_t>(size.width)).Text("plumb_bob");
  out.Count(5).All(std::array<double, 5>{});
  out.All(std::array{c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0});
  out.All(std::array{1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  out.All(std::array{c.fx, 0.0, c.cx, 0.0, 0.0, c.fy, c.cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  out.All(std::array<uint32_t, 6>{}).Put(uint8_t{0});  // neither binning nor a region of interest
  return out;
}

CdrWriter DiagnosticsMessage(int64_t stamp, const std::vector<Diagnostic>& all) {
  CdrWriter out;
  Put(out, MessageHeader{stamp, ""}).Count(all.size());
  for (const Diagnostic& one : all) {
    out.Put(static_cast<uint8_t>(one.level)).Text(one.name).Text(one.message).Text("");
    out.Count(one.values.size());
    for (const auto& [key, value] : one.values) out.Text(key).Text(value);
  }
  return out;
}

}  // namespace oaslam
