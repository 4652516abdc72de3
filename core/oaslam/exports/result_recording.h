#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/exports/result_topics.h"
#include "oaslam/ids.h"

namespace oaslam {

// What a run tells of one image.
struct RecordedResult {
  double timestamp = 0;  // seconds
  std::string state{};   // "tracking"...
  bool is_lost = false;
  // What happened to the map, a sentence for people each.
  std::vector<std::string> events{};
  WorldId world{};                         // of the map
  std::optional<Rigid3> world_from_cam{};  // nothing while the camera is lost
  PoseCovariance covariance = PoseCovariance::Zero();
  const Map* map = nullptr;             // null while there is none
  Camera camera{};                      // of the picture; its distortion is ignored
  cv::Mat picture{};                    // 8-bit BGR, without distortion
  std::vector<Detection> detections{};  // in the pixels of the picture
};

// Records a run image by image (ResultTopics). The map is written when it has changed, at most once
// a second, and less often as it grows, so that a recording grows steadily; after an event at once.
class ResultRecording {
 public:
  // Throws as McapWriter does.
  explicit ResultRecording(const std::string& path);
  void Add(const RecordedResult& result, const ClassNames& names);
  void Finish() { topics_.Finish(); }

 private:
  void AddMap(const RecordedResult& result, const ClassNames& names);
  // Turns the frame `map` where the map knows its vertical better.
  void Level(const RecordedResult& result);

  ResultTopics topics_;
  uint16_t path_;
  std::string state_;
  bool is_map_urgent_ = false;
  WorldId world_;                    // of the map that was written
  std::optional<uint64_t> version_;  // of it
  double next_map_s_ = 0;
  RosMapFrame frame_;
};

}  // namespace oaslam
