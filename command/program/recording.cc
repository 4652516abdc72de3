#include "recording.h"

#include "oaslam/geometry/camera_model.h"
#include "oaslam/images/image_files.h"
#include "oaslam/relocalization/snapshot_content.h"

namespace oaslam::apps {
namespace {

std::optional<Rigid3> InverseOf(const std::optional<Rigid3>& pose) {
  return pose ? std::optional(pose->Inverse()) : std::nullopt;
}

}  // namespace

CLI::Option* AddRecordingOptions(CLI::App& app, RecordingSettings& settings) {
  return app
      .add_option("--record", settings.path,
                  "video (.mp4) of the images with objects, anchors and the path drawn into them")
      ->type_name("FILE");
}

Recording::Recording(const RecordingSettings& settings) {
  if (settings.IsAskedFor()) video_.emplace(settings.path);
}

void Recording::Begin(const Slam& slam, const Camera& camera) {
  if (!video_) return;
  camera_ = camera;
  const MapSnapshot map = slam.Snapshot();
  names_ = map.CategoryNames();
  map_ = *MapOf(map);
}

void Recording::Add(const FrameInput& frame, ArFrame shown) {
  const cv::Mat image = InColor(frame.input.image, frame.path, frame.orientation);
  cv::Mat picture = pictures_.Make(camera_, image);
  shown.camera = Scaled(camera_, picture.cols, picture.rows);
  DrawArPicture(shown, names_, picture);
  video_->Add(picture, frame.input.timestamp);
}

void Recording::Add(const Slam& slam, const FrameInput& frame, const TrackingResult& result) {
  if (!video_) return;
  const MapSnapshot map = slam.Snapshot();
  Add(frame, ArFrame{.cam_from_world = InverseOf(result.PoseIn(map.world())),
                     .map = MapOf(map).get(),
                     .state = ToString(result.state),
                     .objects = result.objects,
                     .confidence = result.confidence});
}

void Recording::Add(const FrameInput& frame, const RelocalizationResult& result) {
  if (!video_) return;
  Add(frame, ArFrame{.cam_from_world = InverseOf(result.world_from_cam),
                     .map = &map_,
                     .state = ToString(result.evidence),
                     .objects = result.matched_objects,
                     .confidence = result.confidence});
}

void Recording::Finish() {
  if (video_) video_->Finish();
}

}  // namespace oaslam::apps
