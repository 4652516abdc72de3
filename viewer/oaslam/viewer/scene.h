#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/class_names.h"
#include "oaslam/pictures/ideal_picture.h"
#include "oaslam/storage/recordings.h"
#include "oaslam/viewer/crops.h"
#include "oaslam/viewer/frame_record.h"
#include "oaslam/viewer/landmark_colors.h"
#include "oaslam/viewer/message.h"
#include "oaslam/viewer/path.h"

namespace oaslam {

// The status of a run, or of a saved one.
struct SceneStatus {
  bool live = false;  // images are coming
  bool paused = false;
  bool mapping = true;  // else localization only
  int dropped = 0;      // images that came too late
  std::string title;
  MapRecordings recordings{};  // of the map, which are shown apart
  bool operator==(const SceneStatus&) const = default;
};

// What one viewer has received. It gets everything new since then in one message, so that nothing
// queues up for a slow viewer.
struct SceneCursor {
  std::shared_ptr<const Map> map;
  uint64_t generation = 0, path = 0, frame = 0, status = 0, groundtruth = 0;
  size_t colors = 0, events = 0, notes = 0;
};

// Everything that viewers show. Used on the server's thread only.
class Scene {
 public:
  explicit Scene(ClassNames names) : names_(std::move(names)) {}

  // Adds an image with its result; without a map in its view, only its note is kept.
  void Add(FrameRecord record);
  // The map with the trajectory of its frames, as loaded or as finished.
  void SetMap(std::shared_ptr<const Map> map, const std::vector<FramePose>& trajectory);
  // Replaces the map by an edited one.
  void UpdateMap(std::shared_ptr<const Map> map);
  void SetNotes(std::vector<FrameNote> notes);
  void SetGroundtruth(std::vector<float> positions);  // x y z each, in the map's frame
  void SetStatus(const SceneStatus& status);
  // `frame` below 0: the event belongs to no frame.
  void AddEvent(int frame, const std::string& kind, const std::string& text);
  // The image of a frame of a saved map.
  void AddPicture(int frame_index, const cv::Mat& image);
  // Removes everything but the events.
  void Clear();

  // The message with everything new since `cursor`; nothing if there is nothing new.
  std::optional<std::string> News(SceneCursor& cursor);
  // Everything about one object; nothing if it is not in the map.
  std::optional<std::string> DescribeObject(ObjectId id) const;
  // The content of a keyframe as of a frame; nothing if it is not in the map.
  std::optional<std::string> DescribeKeyframe(KeyframeId id) const;

  const Map* map() const { return map_.get(); }
  const Path& path() const { return path_; }

 private:
  void TakePicture();
  void NoteState(const FrameRecord& record);
  void NoteMap(const Map& map, int frame);
  void AddNotes(SceneCursor& cursor, MessageBuilder& message) const;

  ClassNames names_;
  uint64_t generation_ = 0;  // number of times that everything was removed
  std::shared_ptr<const Map> map_;
  Path path_;
  LandmarkColors colors_;
  Crops crops_;
  static constexpr int kMaxPictureSide = 640;  // pixels, about as wide as the page shows it
  IdealPictureMaker picture_maker_{kMaxPictureSide};
  std::map<int, std::vector<uint8_t>> pictures_;  // JPEG, by frame; of a saved map
  std::optional<FrameRecord> frame_;              // the newest with a view
  cv::Mat picture_;                               // picture of `frame_`
  std::vector<uint8_t> jpeg_;
  uint64_t frame_count_ = 0;
  std::vector<FrameNote> notes_;
  std::vector<nlohmann::json> events_;
  std::vector<float> groundtruth_;
  uint64_t groundtruth_count_ = 0;
  SceneStatus status_;
  uint64_t status_count_ = 1;
};

}  // namespace oaslam
