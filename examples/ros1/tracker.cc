#include "tracker.h"

#include <algorithm>

#include "oaslam/oaslam.h"

namespace {

oaslam::SlamConfig ConfigOf(const Settings& settings) {
  oaslam::SlamConfig config;
  config.runner.mode = oaslam::RunnerMode::kLive;
  if (!settings.config.empty()) oaslam::LoadConfig(settings.config, config);
  return config;
}

oaslam::Camera CameraOf(const Lens& lens) {
  oaslam::Camera camera{.width = lens.width,
                        .height = lens.height,
                        .fx = lens.fx,
                        .fy = lens.fy,
                        .cx = lens.cx,
                        .cy = lens.cy};
  if (lens.is_equidistant) camera.model = oaslam::LensModel::kFisheye;
  std::copy(lens.distortion.begin(), lens.distortion.end(), camera.distortion.begin());
  oaslam::CheckCalibration(camera, "camera_info");
  return camera;
}

// The rotation to a frame with z up (REP 103): x is the direction of view of the first keyframe,
// made horizontal where the map's vertical is known.
Eigen::Quaterniond RosFromWorld(const oaslam::MapSnapshot& map) {
  const Eigen::Matrix3d axes{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}};
  const Eigen::Quaterniond rotation(axes);
  const auto up = map.up();
  if (!up) return rotation;
  return Eigen::Quaterniond::FromTwoVectors(rotation * *up, Eigen::Vector3d::UnitZ()) * rotation;
}

}  // namespace

struct Tracker::Impl {
  Impl(const Settings& settings, const Lens& lens)
      : slam(ConfigOf(settings), CameraOf(lens)), is_mapping(settings.mapping) {
    if (!settings.map.empty()) slam.Load(settings.map);
    slam.SetMapping(is_mapping);
    ros_from_world = RosFromWorld(slam.Snapshot());
    if (settings.detector.empty()) return;
    detector = oaslam::Detector::Load(settings.detector);
    boxes.emplace([this](const cv::Mat& image) { return detector->Detect(image); });
  }

  Eigen::Isometry3d InRos(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& place) const {
    return Eigen::Translation3d(ros_from_world * place) * (ros_from_world * rotation);
  }

  oaslam::Slam slam;
  bool is_mapping = true;
  Eigen::Quaterniond ros_from_world;
  std::unique_ptr<oaslam::Detector> detector;
  std::optional<oaslam::BackgroundDetector> boxes;
  std::optional<int> piece;         // TrackingResult::piece of the last image
  std::optional<uint64_t> version;  // of the map whose objects were asked for
};

Tracker::Tracker(const Settings& settings, const Lens& lens)
    : impl_(std::make_unique<Impl>(settings, lens)) {}

Tracker::~Tracker() = default;

Answer Tracker::Track(const cv::Mat& image, double timestamp) try {
  Impl& i = *impl_;
  const oaslam::TrackingResult result = i.slam.Process(
      {.image = image, .timestamp = timestamp, .detections_follow = i.boxes.has_value()});
  if (i.boxes) {
    i.boxes->Offer(result.frame, image);
    for (const auto& late : i.boxes->Take()) i.slam.AddDetections(late.frame, late.detections);
  }
  Answer answer;
  answer.state = oaslam::ToString(result.state);
  answer.is_another_map = i.piece && *i.piece != result.piece;
  i.piece = result.piece;
  if (const auto& pose = result.world_from_cam)
    answer.map_from_cam = i.InRos(pose->rotation, pose->translation);
  return answer;
} catch (const oaslam::InputError& error) {
  Answer answer;
  answer.problem = error.what();
  return answer;
}

std::optional<std::vector<MappedObject>> Tracker::ObjectsIfNew() {
  const oaslam::MapSnapshot map = impl_->slam.Snapshot();
  if (impl_->version == map.version()) return std::nullopt;
  impl_->version = map.version();
  std::vector<MappedObject> objects;
  for (const auto& object : map.Objects()) {
    const oaslam::Ellipsoid& e = object.ellipsoid;
    objects.push_back({static_cast<int>(object.id), object.name, impl_->InRos(e.rotation, e.center),
                       e.half_axes});
  }
  return objects;
}

bool Tracker::IsMetric() const { return impl_->slam.Snapshot().is_metric(); }

void Tracker::Save(const std::string& path) {
  if (impl_->is_mapping) impl_->slam.Finish();
  impl_->slam.Save(path);
}
