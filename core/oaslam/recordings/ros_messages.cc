#include "oaslam/recordings/ros_messages.h"

#include <algorithm>

#include "oaslam/camera_file.h"
#include "oaslam/formats/lens_models.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {
namespace {

// The values of a message. CDR aligns them, counted from behind its head, and its texts end with a
// NUL; both orders of bytes occur.
class RosFields {
 public:
  explicit RosFields(const RecordedMessage& message)
      : is_ros1_(message.topic->encoding == MessageEncoding::kRos1), in_(message.data, "") {
    if (is_ros1_) return;
    constexpr uint64_t kHead = 4;
    if (message.data.size() < kHead || message.data[0] != 0 || message.data[1] > 1)
      throw BadInput("a CDR of another kind than 00 00 and 00 01 (XCDR2 is not read)");
    swaps_ = message.data[1] == 0;
    in_ = RecordBytes(message.data.subspan(kHead), "");
  }

  bool is_ros1() const { return is_ros1_; }
  uint64_t left() const { return in_.left(); }

  template <typename T>
  T Get() {
    if (!is_ros1_) Take((sizeof(T) - in_.at() % sizeof(T)) % sizeof(T));
    std::array<uint8_t, sizeof(T)> bytes;
    std::ranges::copy(Take(sizeof(T)), bytes.begin());
    if (swaps_) std::ranges::reverse(bytes);
    return std::bit_cast<T>(bytes);
  }
  template <size_t N>
  void Get(std::array<double, N>& values) {
    for (double& value : values) value = Get<double>();
  }
  Eigen::Vector3d Vector() {
    const double x = Get<double>(), y = Get<double>(), z = Get<double>();
    return {x, y, z};
  }
  // The number of elements of a sequence, each of at least so many bytes.
  uint32_t Count(uint64_t least) {
    const auto count = Get<uint32_t>();
    if (count > left() / least)
      throw BadInput("a sequence of {} elements, where {} bytes are left", count, left());
    return count;
  }
  ByteView Bytes() { return Take(Get<uint32_t>()); }
  std::string Text() {
    ByteView bytes = Bytes();
    if (!is_ros1_ && !bytes.empty()) bytes = bytes.first(bytes.size() - 1);
    return {bytes.begin(), bytes.end()};
  }
  RosHeader Header() {
    constexpr int64_t kSecond = 1'000'000'000;
    if (is_ros1_) Get<uint32_t>();  // its number
    const int64_t seconds = is_ros1_ ? int64_t{Get<uint32_t>()} : int64_t{Get<int32_t>()};
    RosHeader header{.stamp = seconds * kSecond + Get<uint32_t>(), .frame = Text()};
    if (header.frame.starts_with('/')) header.frame.erase(0, 1);
    return header;
  }

 private:
  ByteView Take(uint64_t count) {
    if (count > left())
      throw BadInput("a value of {} bytes, where {} are left of the message", count, left());
    return in_.Take(count);
  }

  bool is_ros1_, swaps_ = false;
  RecordBytes in_;
};

bool IsFinite(const std::array<double, 7>& values) {
  return std::ranges::all_of(values, [](double v) { return std::isfinite(v); });
}

}  // namespace

RosImage ReadRosImage(const RecordedMessage& message, bool part) {
  RosFields in(message);
  RosImage image{.header = in.Header()};
  image.height = in.Get<uint32_t>();
  image.width = in.Get<uint32_t>();
  image.encoding = in.Text();
  image.is_big_endian = in.Get<uint8_t>() != 0;
  image.step = in.Get<uint32_t>();
  if (!part) image.data = in.Bytes();
  return image;
}

RosCompressedImage ReadRosCompressedImage(const RecordedMessage& message, bool part) {
  RosFields in(message);
  RosCompressedImage image{.header = in.Header()};
  image.format = in.Text();
  if (!part) image.data = in.Bytes();
  return image;
}

RosCameraInfo ReadRosCameraInfo(const RecordedMessage& message) {
  RosFields in(message);
  RosCameraInfo info{.header = in.Header()};
  info.height = in.Get<uint32_t>();
  info.width = in.Get<uint32_t>();
  info.model = in.Text();
  const uint32_t count = in.Count(sizeof(double));
  for (uint32_t i = 0; i < count; ++i) info.d.push_back(in.Get<double>());
  in.Get(info.k);
  in.Get(info.r);
  in.Get(info.p);
  info.binning_x = in.Get<uint32_t>();
  info.binning_y = in.Get<uint32_t>();
  info.x_offset = in.Get<uint32_t>();
  info.y_offset = in.Get<uint32_t>();
  return info;
}

RosImu ReadRosImu(const RecordedMessage& message) {
  RosFields in(message);
  RosImu imu{.header = in.Header()};
  std::array<double, 4> orientation{};
  std::array<double, 9> covariance{};
  in.Get(orientation);
  in.Get(covariance);
  imu.angular_velocity = in.Vector();
  in.Get(covariance);
  imu.acceleration = in.Vector();
  return imu;
}

std::vector<RosTransform> ReadRosTransforms(const RecordedMessage& message) {
  constexpr uint64_t kLeast = 64;  // bytes: two empty texts and seven numbers
  RosFields in(message);
  const uint32_t count = in.Count(kLeast);
  std::vector<RosTransform> transforms;
  for (uint32_t i = 0; i < count; ++i) {
    const RosHeader header = in.Header();
    RosTransform transform{.parent = header.frame, .child = in.Text(), .stamp = header.stamp};
    if (transform.child.starts_with('/')) transform.child.erase(0, 1);
    std::array<double, 7> v{};  // x y z, then the quaternion x y z w
    in.Get(v);
    transform.parent_from_child = {Rigid3::Rotation(v[6], v[3], v[4], v[5]), {v[0], v[1], v[2]}};
    if (!IsFinite(v) || !Rigid3::IsUnit(transform.parent_from_child.rotation)) continue;
    transform.parent_from_child.rotation.normalize();
    transforms.push_back(std::move(transform));
  }
  return transforms;
}

RosDetections ReadRosDetections(const RecordedMessage& message) {
  constexpr uint64_t kLeastDetection = 56, kLeastHypothesis = 356;  // bytes
  RosFields in(message);
  RosDetections found{.header = in.Header()};
  const uint32_t count = in.Count(kLeastDetection);
  for (uint32_t i = 0; i < count; ++i) {
    RosDetection detection;
    in.Header();
    const uint32_t hypotheses = in.Count(kLeastHypothesis);
    for (uint32_t k = 0; k < hypotheses; ++k) {
      RosDetection::Hypothesis hypothesis{.class_id = in.Text(), .score = in.Get<double>()};
      std::array<double, 7 + 36> pose{};  // of the object, with its covariance
      in.Get(pose);
      detection.hypotheses.push_back(std::move(hypothesis));
    }
    for (double* value :
         {&detection.x, &detection.y, &detection.theta, &detection.width, &detection.height})
      *value = in.Get<double>();
    in.Text();  // its id
    found.detections.push_back(std::move(detection));
  }
  constexpr uint64_t kPadding = 4;
  if (in.is_ros1() || in.left() >= kPadding)
    throw BadInput("is in the layout of another version of vision_msgs than 3 and 4");
  return found;
}

std::optional<Camera> CameraOfInfo(const RosCameraInfo& info, bool is_rectified,
                                   const std::string& place) {
  if (is_rectified ? info.p[0] == 0 : !info.IsCalibrated()) return std::nullopt;
  if (info.binning_x > 1 || info.binning_y > 1)
    throw BadInput("{}: binning: {} x {}, allowed: 0 or 1", place, info.binning_x, info.binning_y);
  if (info.x_offset != 0 || info.y_offset != 0)
    throw BadInput("{}: roi: offset {} {}, allowed: 0", place, info.x_offset, info.y_offset);
  if (info.width == 0 || info.height == 0 || info.width > uint32_t{kMaxSide} ||
      info.height > uint32_t{kMaxSide})
    throw BadInput("{}: images of {} x {}", place, info.width, info.height);
  Camera camera{.width = static_cast<int>(info.width), .height = static_cast<int>(info.height)};
  if (is_rectified) {
    camera.fx = info.p[0], camera.cx = info.p[2], camera.fy = info.p[5], camera.cy = info.p[6];
  } else {
    camera.fx = info.k[0], camera.cx = info.k[2], camera.fy = info.k[4], camera.cy = info.k[5];
    const LensPlace lens{place, "D", {camera.width, camera.height}};
    if (!info.model.empty()) camera.model = LensModelOf(info.model, {place, "distortion_model"});
    CheckCalibration(camera, place);
    if (!info.d.empty()) SetDistortion(camera, info.d, lens);
  }
  CheckCalibration(camera, place);
  return camera;
}

}  // namespace oaslam
