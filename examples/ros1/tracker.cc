#include "tracker.h"

#include "oaslam/oaslam.h"

namespace {

oaslam::Camera CameraOf(const CameraInfo& info) {
  oaslam::Camera camera{.width = info.width,
                        .height = info.height,
                        .fx = info.fx,
                        .fy = info.fy,
                        .cx = info.cx,
                        .cy = info.cy};
  if (info.distortion_model == "equidistant")
    camera.model = oaslam::LensModel::kFisheye;
  else if (info.distortion_model != "plumb_bob" && !info.distortion.empty())
    throw oaslam::InputError("camera_info: distortion_model \"" + info.distortion_model +
                             "\", allowed: plumb_bob, equidistant");
  if (info.distortion.size() > camera.distortion.size())
    throw oaslam::InputError("camera_info: more than 5 coefficients of distortion");
  std::copy(info.distortion.begin(), info.distortion.end(), camera.distortion.begin());
  oaslam::CheckCalibration(camera, "camera_info");
  return camera;
}

oaslam::SlamConfig ConfigOf(const TrackerOptions& options) {
  oaslam::SlamConfig config;
  oaslam::ApplySetting("runner.mode=" + options.mode, config);
  return config;
}

}  // namespace

class Tracker::Impl {
 public:
  Impl(const TrackerOptions& options, const CameraInfo& camera)
      : slam_(ConfigOf(options), CameraOf(camera)) {
    if (!options.map_in.empty()) slam_.Load(options.map_in);
    if (options.detector.empty()) return;
    detector_ = oaslam::Detector::Load(options.detector);
    boxes_ = std::make_unique<oaslam::BackgroundDetector>(
        [this](const cv::Mat& image) { return detector_->Detect(image); });
  }

  Tracked Track(const cv::Mat& image, double timestamp) {
    const oaslam::TrackingResult result = slam_.Process(
        {.image = image, .timestamp = timestamp, .detections_follow = boxes_ != nullptr});
    if (boxes_) {
      boxes_->Offer(result.frame, image);
      for (const auto& late : boxes_->Take()) slam_.AddDetections(late.frame, late.detections);
    }
    Tracked tracked{oaslam::ToString(result.state), {}};
    if (const auto& pose = result.world_from_cam)
      tracked.world_from_cam = Pose{pose->rotation, pose->translation};
    return tracked;
  }

  std::vector<Thing> Things() const {
    std::vector<Thing> things;
    for (const auto& object : slam_.Snapshot().Objects())
      things.push_back({object.id,
                        object.name,
                        {object.ellipsoid.rotation, object.ellipsoid.center},
                        2 * object.ellipsoid.half_axes});
    return things;
  }

  void Save(const std::string& path) {
    slam_.Finish();
    slam_.Save(path);
  }

 private:
  oaslam::Slam slam_;
  std::unique_ptr<oaslam::Detector> detector_;
  std::unique_ptr<oaslam::BackgroundDetector> boxes_;  // ends before the detector that it calls
};

Tracker::Tracker(const TrackerOptions& options, const CameraInfo& camera)
    : impl_(std::make_unique<Impl>(options, camera)) {}
Tracker::~Tracker() = default;
Tracked Tracker::Track(const cv::Mat& image, double timestamp) {
  return impl_->Track(image, timestamp);
}
std::vector<Thing> Tracker::Things() const { return impl_->Things(); }
void Tracker::Save(const std::string& path) { impl_->Save(path); }
