#include "recording.h"

#include <filesystem>
#include <utility>

#include "oaslam/formats/text.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/images/image_files.h"
#include "oaslam/recordings/recording_reader.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {
namespace {

std::optional<Rigid3> InverseOf(const std::optional<Rigid3>& pose) {
  return pose ? std::optional(pose->Inverse()) : std::nullopt;
}

// A file in the folder of a rosbag2 may become a part of that recording.
void CheckIsNotRead(const std::string& path, const std::string& images) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path folder = fs::absolute(path, error).parent_path();
  const bool is_part = LowerExtension(path) == ".mcap" && fs::equivalent(folder, images, error);
  if (fs::equivalent(path, images, error) || (is_part && IsRecording(images)))
    throw BadInput("--record {}: would change {}, which is read", path, images);
}

// Boxes of the picture.
std::vector<Detection> InPicture(std::vector<Detection> detections, const Camera& camera,
                                 const cv::Mat& picture) {
  const double scale = static_cast<double>(picture.cols) / camera.width;
  for (Detection& detection : detections) {
    const Box box = UndistortBox(camera, detection.box);
    detection.box = {scale * box.x1, scale * box.y1, scale * box.x2, scale * box.y2};
  }
  return detections;
}

// For people; empty: is shown otherwise.
std::string TextOf(const SlamEvent& event) {
  const std::string submap =
      event.submap.IsValid() ? "world " + ToString(event.submap) : "a submap";
  switch (event.kind) {
    case SlamEventKind::kSubmapBegan:
      return "a submap grows: " + submap;
    case SlamEventKind::kSubmapJoined:
      return submap + " was joined with the map";
    case SlamEventKind::kLoopClosed:
      return "a loop was closed";
    case SlamEventKind::kMetric:
      return "the map is in metres";
    default:
      return "";
  }
}

}  // namespace

CLI::Option* AddRecordingOptions(CLI::App& app, RecordingSettings& settings) {
  return app
      .add_option("--record", settings.path,
                  "video (.mp4) of the images with objects, anchors and the path drawn into them; "
                  "or all results as a recording of ROS 2 (.mcap), for Foxglove, RViz and Rerun")
      ->type_name("FILE");
}

Recording::Recording(const RecordingSettings& settings, const std::string& images) {
  // Of the longer side, pixels; a larger video takes long to encode, larger JPEGs fill the disk.
  constexpr int kMaxSideOfVideo = 1920, kMaxSideOfJpeg = 960;
  if (!settings.IsAskedFor()) return;
  const std::string extension = LowerExtension(settings.path);
  if (extension != ".mp4" && extension != ".mcap")
    throw BadInput("--record {}: allowed: .mp4, .mcap", settings.path);
  CheckIsNotRead(settings.path, images);
  pictures_.emplace(extension == ".mp4" ? kMaxSideOfVideo : kMaxSideOfJpeg);
  if (extension == ".mp4")
    video_.emplace(settings.path);
  else
    results_.emplace(settings.path);
}

void Recording::Begin(const Slam& slam, const Camera& camera) {
  if (!IsOn()) return;
  camera_ = camera;
  const MapSnapshot map = slam.Snapshot();
  names_ = map.CategoryNames();
  map_ = *MapOf(map);
  states_ = slam.States();
  NewEvents();
}

std::vector<std::string> Recording::NewEvents() {
  std::vector<std::string> texts;
  for (const SlamEvent& event : states_->EventsAfter(last_event_)) {
    last_event_ = event.number;
    if (std::string text = TextOf(event); !text.empty()) texts.push_back(std::move(text));
  }
  return texts;
}

void Recording::Add(const FrameInput& frame, ArFrame shown, RecordedResult result) {
  const cv::Mat image = InColor(frame.input.image, frame.path, frame.orientation);
  cv::Mat picture = pictures_->Make(camera_, image);
  shown.camera = Scaled(camera_, picture.cols, picture.rows);
  DrawArPicture(shown, names_, picture);
  if (video_) return video_->Add(picture, frame.input.timestamp);
  result.timestamp = frame.input.timestamp;
  result.state = shown.state;
  result.map = shown.map;
  result.camera = shown.camera;
  result.detections = InPicture(frame.input.detections, camera_, picture);
  DrawBoxes(result.detections, picture);
  result.picture = std::move(picture);
  try {
    results_->Add(result, names_);
  } catch (const InputError&) {
    failure_ = std::current_exception();
    results_.reset();
  }
}

void Recording::Add(const Slam& slam, const FrameInput& frame, const TrackingResult& result) {
  if (!IsOn()) return;
  const MapSnapshot map = slam.Snapshot();
  const std::optional<Rigid3> world_from_cam = result.PoseIn(map.world());
  RecordedResult recorded{.is_lost = IsLost(result.state),
                          .events = NewEvents(),
                          .world = map.world(),
                          .world_from_cam = world_from_cam,
                          .covariance = result.covariance};
  Add(frame,
      ArFrame{.cam_from_world = InverseOf(world_from_cam),
              .map = MapOf(map).get(),
              .state = ToString(result.state),
              .objects = result.objects,
              .confidence = result.confidence},
      std::move(recorded));
}

void Recording::Add(const FrameInput& frame, const RelocalizationResult& result) {
  if (!IsOn()) return;
  Add(frame,
      ArFrame{.cam_from_world = InverseOf(result.world_from_cam),
              .map = &map_,
              .state = ToString(result.evidence),
              .objects = result.matched_objects,
              .confidence = result.confidence},
      {.is_lost = !result.world_from_cam,
       .world = result.world,
       .world_from_cam = result.world_from_cam,
       .covariance = result.covariance});
}

void Recording::Finish() {
  if (video_) video_->Finish();
  if (results_) results_->Finish();
  if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
}

}  // namespace oaslam::apps
