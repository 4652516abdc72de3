#include "oaslam/exports/result_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "oaslam/storage/map_file.h"

namespace oaslam {
namespace {

// About how long the messages of a map are.
double BytesOf(const Map& map) {
  constexpr double kKeyframe = 80, kLandmark = 12, kObject = 1000;
  return kKeyframe * static_cast<double>(map.keyframes.size()) +
         kLandmark * static_cast<double>(map.landmarks.size()) + kObject * map.CountMappedObjects();
}

}  // namespace

ResultRecording::ResultRecording(const std::string& path)
    : topics_(path), path_(topics_.AddPathTopic("/oaslam/path")) {}

void ResultRecording::Add(const RecordedResult& result, const ClassNames& names) {
  const double time = result.timestamp;
  if (result.state != state_) topics_.AddEvent(time, result.is_lost, result.state);
  state_ = result.state;
  for (const std::string& event : result.events) topics_.AddEvent(time, false, event);
  is_map_urgent_ |= !result.events.empty();
  if (result.map) AddMap(result, names);
  if (result.world_from_cam) {
    topics_.AddTransform(time, kCameraFrame, *result.world_from_cam);
    topics_.AddPose(time, *result.world_from_cam, result.covariance);
  }
  topics_.AddPicture(time, result.picture, result.camera);
  topics_.AddDetections(time, result.detections, names);
}

void ResultRecording::AddMap(const RecordedResult& result, const ClassNames& names) {
  constexpr double kInterval = 1, kBytesPerSecond = 1e6;
  const Map& map = *result.map;
  const bool is_new_world = result.world != world_ || !version_;
  const bool is_due = is_new_world || is_map_urgent_ ||
                      (map.version != version_ && !(result.timestamp < next_map_s_));
  if (!is_due) return;
  if (is_new_world && version_)
    topics_.AddEvent(result.timestamp, true,
                     fmt::format("the map is another one, or has another unit: world {}",
                                 ToString(result.world)));
  Level(result);
  topics_.AddPath(result.timestamp, path_, KeyframePoses(map));
  topics_.AddMap(result.timestamp, map, names);
  world_ = result.world;
  version_ = map.version;
  is_map_urgent_ = false;
  next_map_s_ = result.timestamp + std::max(kInterval, BytesOf(map) / kBytesPerSecond);
}

void ResultRecording::Level(const RecordedResult& result) {
  const double angle = frame_.Follow(*result.map, result.world);
  if (angle > 0)
    topics_.AddEvent(
        result.timestamp, false,
        fmt::format("the map was turned by {:.1f} degrees: its vertical is known better",
                    angle * 180 / std::numbers::pi));
  topics_.SetMapFromWorld(frame_.map_from_world());
}

}  // namespace oaslam
