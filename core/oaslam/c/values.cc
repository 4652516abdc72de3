#include "oaslam/c/values.h"

#include <algorithm>
#include <cstring>
#include <iterator>

#include "oaslam/export_map.h"
#include "oaslam/log.h"

namespace oaslam::c {

static_assert(OASLAM_PRELIMINARY == static_cast<int>(TrackingState::kPreliminary));
static_assert(OASLAM_LOST == static_cast<int>(TrackingState::kLost));
static_assert(OASLAM_FROM_REGISTRATION == static_cast<int>(PoseSource::kRegistration));
static_assert(OASLAM_FOUND_BY_BOTH == static_cast<int>(PoseEvidence::kPointsAndObjects));
static_assert(OASLAM_USE_BOTH == static_cast<int>(RelocalizationMode::kPointsAndObjects));
static_assert(OASLAM_MCAP == static_cast<int>(MapFormat::kMcap));
static_assert(OASLAM_LOG_WARNING == static_cast<int>(LogLevel::kWarning));
static_assert(OASLAM_MAP_IS_METRIC == static_cast<int>(SlamEventKind::kMetric));
static_assert(OASLAM_ANCHOR_REMOVED == static_cast<int>(SlamEventKind::kAnchorRemoved));
static_assert(OASLAM_NO_WORLD == WorldId::kInvalid);
static_assert(OASLAM_HIT_LANDMARK == static_cast<int>(HitKind::kLandmark));

namespace {

std::string& Error() noexcept {
  thread_local std::string error;
  return error;
}

MotionInput MotionOf(const oaslam_motion& m) {
  MotionInput motion;
  motion.is_known = m.is_known != 0;
  motion.run = m.run;
  motion.image = m.image;
  motion.odom_from_cam = *PoseOf(&m.odom_from_cam);
  motion.is_preliminary = m.is_preliminary != 0;
  motion.is_keyframe = m.is_keyframe != 0;
  if (m.agreeing != 0) motion.agreeing = m.agreeing;
  motion.depths = VectorOf<MotionInput::PointDepth>(
      m.depths, m.depth_count, [](const oaslam_point_depth& d) -> MotionInput::PointDepth {
        return {{d.pixel[0], d.pixel[1]}, d.inverse_depth};
      });
  motion.corrected = VectorOf<MotionInput::CorrectedPose>(
      m.corrected, m.corrected_count,
      [](const oaslam_corrected_pose& c) -> MotionInput::CorrectedPose {
        return {c.image, *PoseOf(&c.odom_from_cam)};
      });
  return motion;
}

ImageFeatures FeaturesOf(const oaslam_features& f) {
  ImageFeatures features;
  if (f.levels != 0) features.levels = f.levels;
  if (f.factor != 0) features.factor = f.factor;
  if (f.lowest_pixel != 0) features.lowest_pixel = f.lowest_pixel;
  features.features =
      VectorOf<ImageFeature>(f.features, f.count, [](const oaslam_feature& feature) {
        ImageFeature c;
        c.pixel = {feature.pixel[0], feature.pixel[1]};
        c.angle_rad = feature.angle_rad;
        c.level = feature.level;
        std::copy_n(feature.descriptor, c.descriptor.size(), c.descriptor.begin());
        return c;
      });
  return features;
}

DepthImage DepthOf(const oaslam_image& image) {
  DepthImage depth;
  const size_t bytes = image.depth_is_float ? sizeof(float) : sizeof(uint16_t);
  if (image.depth_width <= 0 || image.depth_height <= 0 ||
      image.depth_bytes_per_row < static_cast<size_t>(image.depth_width) * bytes)
    throw InputError("depth: width and height must be above 0, and bytes_per_row hold a row");
  depth.image = {image.depth_height, image.depth_width, image.depth_is_float ? CV_32FC1 : CV_16UC1,
                 const_cast<void*>(image.depth), image.depth_bytes_per_row};
  if (image.depth_unit != 0) depth.unit = image.depth_unit;
  if (image.depth_camera) depth.camera = CameraOf(*image.depth_camera);
  depth.cam_from_depth = PoseOf(image.cam_from_depth).value_or(Rigid3());
  return depth;
}

}  // namespace

const std::string& ErrorOfThread() noexcept { return Error(); }

oaslam_status Failed(oaslam_status status, const char* what) noexcept {
  try {
    Error() = what;
  } catch (...) {  // without the memory for a text the old one stays
  }
  return status;
}

Eigen::Vector3d PointOf(const double (&numbers)[3]) { return Eigen::Vector3d(numbers); }

std::string TextOf(const char* text) { return text ? text : ""; }

oaslam_status StatusOf(const AnchorReport& report) {
  return report.IsDone() ? OASLAM_OK : Failed(OASLAM_REFUSED, report.why_not.c_str());
}

oaslam_pose PoseOf(const Rigid3& pose) {
  oaslam_pose c{};
  Copy(pose.translation, c.translation);
  Copy(pose.rotation.coeffs(), c.rotation);
  return c;
}

std::optional<Rigid3> PoseOf(const oaslam_pose* pose) {
  if (!pose) return std::nullopt;
  const auto& [x, y, z, w] = pose->rotation;
  return Rigid3(Rigid3::Rotation(w, x, y, z), PointOf(pose->translation));
}

Camera CameraOf(const oaslam_camera& c) {
  Camera camera;
  camera.model = c.is_fisheye ? LensModel::kFisheye : LensModel::kPinhole;
  camera.width = c.width, camera.height = c.height;
  camera.fx = c.fx, camera.fy = c.fy, camera.cx = c.cx, camera.cy = c.cy;
  for (size_t i = 0; i < camera.distortion.size(); ++i) camera.distortion[i] = c.distortion[i];
  return camera;
}

oaslam_camera CameraOf(const Camera& camera) {
  oaslam_camera c{};
  c.is_fisheye = camera.model == LensModel::kFisheye;
  c.width = camera.width, c.height = camera.height;
  c.fx = camera.fx, c.fy = camera.fy, c.cx = camera.cx, c.cy = camera.cy;
  for (size_t i = 0; i < camera.distortion.size(); ++i) c.distortion[i] = camera.distortion[i];
  return c;
}

cv::Mat PixelsOf(const uint8_t* pixels, int32_t width, int32_t height, int32_t channels,
                 size_t bytes_per_row) {
  if (channels != 1 && channels != 3 && channels != 4)
    throw InputError("channels: " + std::to_string(channels) + ", allowed: 1, 3, 4");
  if (width <= 0 || height <= 0 ||
      bytes_per_row < static_cast<size_t>(width) * static_cast<size_t>(channels))
    throw InputError("image: width and height must be above 0, and bytes_per_row hold a row");
  return {height, width, CV_8UC(channels), const_cast<uint8_t*>(pixels), bytes_per_row};
}

Detection DetectionOf(const oaslam_detection& d) {
  return {.category_id = d.category_id, .score = d.score, .box = {d.x1, d.y1, d.x2, d.y2}};
}

ImageInput InputOf(const oaslam_image& image) {
  ImageInput input;
  input.timestamp = image.timestamp;
  if (image.pixels)
    input.image =
        PixelsOf(image.pixels, image.width, image.height, image.channels, image.bytes_per_row);
  input.detections = VectorOf<Detection>(image.detections, image.detection_count, DetectionOf);
  input.detections_follow = image.detections_follow != 0;
  if (image.gravity_in_cam)
    input.gravity_in_cam = Eigen::Vector3d(Eigen::Map<const Eigen::Vector3d>(image.gravity_in_cam));
  input.angular_velocity =
      VectorOf<AngularVelocity>(image.angular_velocity, image.angular_velocity_count,
                                [](const oaslam_angular_velocity& v) -> AngularVelocity {
                                  return {v.timestamp, PointOf(v.in_cam)};
                                });
  input.imu =
      VectorOf<ImuSample>(image.imu, image.imu_count, [](const oaslam_imu_sample& s) -> ImuSample {
        return {s.timestamp, PointOf(s.angular_velocity), PointOf(s.acceleration)};
      });
  if (image.motion) input.motion = MotionOf(*image.motion);
  if (image.features) input.features = FeaturesOf(*image.features);
  if (image.depth) input.depth = DepthOf(image);
  return input;
}

oaslam_imu_calibration CalibrationOf(const ImuCalibration& imu) {
  oaslam_imu_calibration c{};
  c.gyroscope = static_cast<oaslam_sensor_state>(imu.gyroscope.state);
  c.accelerometer = static_cast<oaslam_sensor_state>(imu.accelerometer);
  Copy(imu.gyroscope.bias, c.gyroscope_bias);
  c.sigma_gyroscope_bias = imu.gyroscope.sigma_bias;
  c.offset_s = imu.gyroscope.offset_s, c.sigma_offset_s = imu.gyroscope.sigma_offset_s;
  Copy(imu.acceleration_bias, c.acceleration_bias);
  c.sigma_acceleration_bias = imu.sigma_acceleration_bias;
  c.sigma_metre = imu.sigma_metre;
  imu.problem.copy(c.problem, sizeof(c.problem) - 1);
  return c;
}

oaslam_result ResultOf(const TrackingResult& r) {
  oaslam_result c{};
  c.frame = r.frame;
  c.timestamp = r.timestamp;
  c.state = static_cast<oaslam_state>(r.state);
  c.source = static_cast<oaslam_source>(r.source);
  c.world = r.world.value;
  c.is_uncertain = r.is_uncertain;
  c.confidence = r.confidence;
  c.seconds_without_map = r.seconds_without_map;
  c.depth = r.depth;
  c.focal_ratio = r.focal_ratio;
  for (int i = 0; i < 36; ++i) c.covariance[i] = r.covariance(i / 6, i % 6);
  c.matched = r.matched.value_or(-1);
  c.inliers = r.inliers.value_or(-1);
  c.detections = r.detections;
  c.objects = r.objects;
  if (const std::optional<Rigid3> pose = r.PoseIn(r.world)) {
    c.reserved.has_pose = 1;
    c.reserved.pose = PoseOf(*pose);
  }
  const size_t count = std::min(std::size(c.elsewhere), r.elsewhere.size());
  c.elsewhere_count = static_cast<int32_t>(count);
  for (size_t i = 0; i < count; ++i) {
    const PoseElsewhere& there = r.elsewhere[r.elsewhere.size() - count + i];
    c.elsewhere[i] = there.world.value;
    c.reserved.elsewhere[i] = PoseOf(there.world_from_cam);
  }
  return c;
}

RelocalizeOptions OptionsOf(const oaslam_relocalize_options* c) {
  if (!c) return {};
  RelocalizeOptions options;
  options.mode = static_cast<RelocalizationMode>(c->mode);
  options.prior = PoseOf(c->prior);
  if (c->camera) options.camera = CameraOf(*c->camera);
  options.unknown_camera = c->unknown_camera != 0;
  options.follow = c->follow != 0;
  return options;
}

oaslam_relocalization RelocalizationOf(const RelocalizationResult& r) {
  oaslam_relocalization c{};
  c.evidence = static_cast<oaslam_evidence>(r.evidence);
  c.world = r.world.value;
  if (r.world_from_cam) c.world_from_cam = PoseOf(*r.world_from_cam);
  c.confidence = r.confidence;
  c.sigma_position = r.sigma_position;
  c.inlier_points = r.inlier_points;
  c.matched_objects = r.matched_objects;
  c.has_camera = r.camera.has_value();
  if (r.camera) c.camera = CameraOf(*r.camera);
  return c;
}

oaslam_ray_hit HitOf(const RayHit& hit) {
  oaslam_ray_hit c{};
  c.kind = static_cast<oaslam_hit_kind>(hit.kind);
  c.id = hit.object ? hit.object->value : hit.landmark ? hit.landmark->value : 0;
  c.distance = hit.distance;
  Copy(hit.position, c.position);
  Copy(hit.normal, c.normal);
  return c;
}

oaslam_event EventOf(const SlamEvent& event) {
  oaslam_event c{};
  c.number = event.number;
  c.kind = static_cast<oaslam_event_kind>(event.kind);
  c.frame = event.frame;
  c.timestamp = event.timestamp;
  c.state = static_cast<oaslam_state>(event.state);
  c.world = event.world.value;
  c.submap = event.submap.value;
  std::strncpy(c.anchor, event.anchor.c_str(), sizeof c.anchor - 1);
  return c;
}

oaslam_stamped_pose StampedPoseOf(const StampedPose& pose) {
  return {pose.timestamp, PoseOf(pose.world_from_cam)};
}

oaslam_tracked_point TrackedPointOf(const TrackedPoint& point) {
  oaslam_tracked_point c{};
  Copy(point.pixel, c.pixel);
  c.sigma_px = point.sigma_px;
  c.has_landmark = point.landmark.has_value();
  if (point.landmark) c.landmark = point.landmark->value;
  Copy(point.position, c.position);
  return c;
}

oaslam_object_presence PresenceOf(const ObjectPresence& p) {
  return {p.id.value, p.category_id, p.expected, p.seen, p.is_missing};
}

ObjectEdit EditOf(const oaslam_object_edit& edit) {
  ObjectEdit c;
  if (edit.name) c.name = edit.name;
  if (edit.is_same) c.same_as = ObjectId(edit.same_as);
  c.remove = edit.remove != 0;
  return c;
}

}  // namespace oaslam::c
