#include "oaslam/viewer/scene.h"

#include <fmt/format.h>

#include "oaslam/images/image_files.h"
#include "oaslam/viewer/frame_message.h"
#include "oaslam/viewer/map_delta.h"
#include "oaslam/viewer/picture.h"

namespace oaslam {

using nlohmann::json;

void Scene::Add(FrameRecord record) {
  NoteState(record);
  const TrackingResult& result = record.result;
  notes_.push_back({result.frame, result.timestamp, result.state, result.inliers.value_or(0),
                    result.ms_total, result.is_uncertain});
  const std::shared_ptr<const Map> map = record.view.map;
  if (record.view.pose && map_ && !map) path_.Add(*record.view.pose, *map_);
  if (!map) return;
  if (map != map_) {
    NoteMap(*map, result.frame);
    map_ = map;
    path_.Update(*map);
  }
  if (record.view.pose) path_.Add(*record.view.pose, *map);
  frame_ = std::move(record);
  picture_ = cv::Mat();
  jpeg_.clear();
  // Without viewers only each eighth frame gets a picture: enough for the colours of landmarks and
  // pictures of objects that a later viewer wants.
  constexpr uint64_t kUnwatchedStep = 8;
  if (++frame_count_ % kUnwatchedStep == 1) TakePicture();
}

// Makes the picture, landmark colours and object crops of the newest frame, and releases its image.
void Scene::TakePicture() {
  const FrameView& view = frame_->view;
  const cv::Mat grey = std::exchange(frame_->image, {});
  if (grey.empty()) return;
  const cv::Mat image = InColor(grey, frame_->image_path, frame_->image_orientation);
  const Camera& camera = *view.frame.camera;
  picture_ = picture_maker_.Make(camera, image);
  const double scale = picture_maker_.ScaleOf(camera);
  if (view.frame.features) colors_.Add(picture_, scale, *view.frame.features, view.landmarks);
  for (size_t i = 0; i < view.detected.size(); ++i)
    if (view.detected[i].IsValid())
      crops_.Add(view.detected[i], frame_->result.frame, picture_, scale,
                 view.frame.detections[i].box);
}

void Scene::NoteState(const FrameRecord& record) {
  const TrackingState now = record.result.state;
  std::optional<TrackingState> before;
  if (!notes_.empty()) before = notes_.back().state;
  const int frame = record.result.frame;
  if (now == TrackingState::kRelocalized) {
    const auto& found = record.view.relocalization;
    if (!found || !found->IsFound())
      AddEvent(frame, "relocalized", "joined with the map made while lost");
    else
      AddEvent(frame, "relocalized",
               fmt::format("by {}: {} points{}, confidence {:.2f}", ToString(found->evidence),
                           found->points.inliers,
                           found->objects.matched.empty()
                               ? ""
                               : fmt::format(", {} objects", found->objects.matched.size()),
                           found->confidence));
  }
  if (before == now) return;
  if (now == TrackingState::kObjects)
    AddEvent(frame, "objects",
             record.view.relocalization
                 ? fmt::format("pose by {} objects alone, confidence {:.2f}",
                               record.view.relocalization->objects.matched.size(),
                               record.view.relocalization->confidence)
                 : "pose by objects alone");
  if (now == TrackingState::kLost)
    AddEvent(frame, "lost", record.view.relocalization ? record.view.relocalization->why_not : "");
  const auto has_no_map = [](TrackingState state) {
    return state == TrackingState::kInitializing || state == TrackingState::kPreliminary;
  };
  const TrackingState last = before.value_or(now);
  if (has_no_map(now) && !has_no_map(last)) {
    AddEvent(frame, "reset", "a new map is started");
    path_.Clear();
  }
  if (now == TrackingState::kTracking && has_no_map(last))
    AddEvent(frame, "map", "initialized from two views");
}

void Scene::NoteMap(const Map& map, int frame) {
  if (!map_) return;
  if (map.loops_closed > map_->loops_closed) AddEvent(frame, "loop", "closed");
  map.objects.ForEachDifference(map_->objects, [&](ObjectId id, const Object* a, const Object* b) {
    const bool was = a && a->state == ObjectState::kMapped,
               is = b && b->state == ObjectState::kMapped;
    if (is && !was)
      AddEvent(frame, "object",
               fmt::format("{} {} mapped", NameOf(names_, b->category_id), id.value));
    if (was && !is && !map.keyframes.empty())
      AddEvent(frame, "object",
               fmt::format("{} {} {}", NameOf(names_, a->category_id), id.value,
                           map.merged_objects.Contains(id) ? "merged into another" : "dropped"));
  });
}

void Scene::SetMap(std::shared_ptr<const Map> map, const std::vector<FramePose>& trajectory) {
  map_ = std::move(map);
  path_.Replace(trajectory, *map_);
}

void Scene::UpdateMap(std::shared_ptr<const Map> map) {
  NoteMap(*map, notes_.empty() ? 0 : notes_.back().frame);
  map_ = std::move(map);
  path_.Update(*map_);
}

void Scene::SetNotes(std::vector<FrameNote> notes) {
  notes_ = std::move(notes);
  ++generation_;
}

void Scene::SetGroundtruth(std::vector<float> positions) {
  if (positions == groundtruth_) return;
  groundtruth_ = std::move(positions);
  ++groundtruth_count_;
}

void Scene::SetStatus(const SceneStatus& status) {
  if (status == status_) return;
  status_ = status;
  ++status_count_;
}

void Scene::AddEvent(int frame, const std::string& kind, const std::string& text) {
  events_.push_back({{"kind", kind}, {"text", text}});
  if (frame >= 0) events_.back()["frame"] = frame;
}

void Scene::AddPicture(int frame_index, const cv::Mat& image) {
  constexpr int kQuality = 75;           // of JPEG: about 30 KB a picture
  constexpr size_t kMaxPictures = 1000;  // 30 MB
  if (!map_) return;
  map_->keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    if (keyframe.frame_index != frame_index) return;
    const Camera& camera = map_->cameras[keyframe.camera];
    if (image.cols != camera.width || image.rows != camera.height) return;
    const cv::Mat picture = picture_maker_.Make(camera, image);
    if (keyframe.features)
      colors_.Add(picture, picture_maker_.ScaleOf(camera), *keyframe.features, keyframe.landmarks);
    if (pictures_.size() < kMaxPictures) pictures_[frame_index] = EncodeJpeg(picture, kQuality);
  });
  map_->objects.ForEach([&](ObjectId id, const Object& object) {
    for (const ObjectObservation& o : object.observations) {
      if (o.frame_index != frame_index || object.state != ObjectState::kMapped) continue;
      const Camera& camera = map_->cameras[o.camera];
      if (image.cols != camera.width || image.rows != camera.height) continue;
      crops_.Add(id, frame_index, picture_maker_.Make(camera, image),
                 picture_maker_.ScaleOf(camera), o.box);
    }
  });
}

void Scene::Clear() {
  map_.reset();
  path_.Clear();
  colors_.Clear();
  crops_.Clear();
  frame_.reset();
  SetNotes({});
}

void Scene::AddNotes(SceneCursor& cursor, MessageBuilder& message) const {
  std::vector<uint32_t> frames, inliers;
  std::vector<uint8_t> states, uncertain;
  std::vector<float> ms;
  for (; cursor.notes < notes_.size(); ++cursor.notes) {
    const FrameNote& note = notes_[cursor.notes];
    frames.push_back(static_cast<uint32_t>(note.frame));
    inliers.push_back(static_cast<uint32_t>(note.inliers));
    states.push_back(static_cast<uint8_t>(note.state));
    ms.push_back(static_cast<float>(note.ms_total));
    uncertain.push_back(note.is_uncertain);
  }
  message.Add("note_frames", frames);
  message.Add("note_inliers", inliers);
  message.Add("note_states", states);
  message.Add("note_ms", ms);
  message.Add("note_uncertain", uncertain);
}

std::optional<std::string> Scene::News(SceneCursor& cursor) {
  const bool has_news = cursor.map != map_ || cursor.path != path_.version() ||
                        cursor.frame != frame_count_ || cursor.status != status_count_ ||
                        cursor.groundtruth != groundtruth_count_ ||
                        cursor.colors != colors_.size() || cursor.events != events_.size() ||
                        cursor.notes != notes_.size() || cursor.generation != generation_;
  if (!has_news) return std::nullopt;
  if (frame_ && cursor.frame != frame_count_ && !frame_->image.empty()) TakePicture();
  MessageBuilder message("update");
  if (cursor.generation != generation_) {
    const size_t events = cursor.events;
    cursor = {};
    cursor.events = events;
    cursor.generation = generation_;
    message.header["restart"] = true;
  }
  if (map_ && cursor.map != map_) AddMapDelta(cursor.map.get(), *map_, names_, message);
  cursor.path = path_.AddDelta(cursor.path, message);
  colors_.AddDelta(cursor.colors, message);
  for (; cursor.events < events_.size(); ++cursor.events)
    message.header["events"].push_back(events_[cursor.events]);
  AddNotes(cursor, message);
  if (cursor.groundtruth != groundtruth_count_) message.Add("groundtruth", groundtruth_);
  if (cursor.status != status_count_) {
    message.header["status"] = {{"live", status_.live},       {"paused", status_.paused},
                                {"mapping", status_.mapping}, {"dropped", status_.dropped},
                                {"title", status_.title},     {"recordings", json::array()}};
    for (const MapRecording& r : status_.recordings)
      message.header["status"]["recordings"].push_back(
          {{"name", r.name}, {"first_frame", r.first_frame}});
  }
  if (cursor.frame != frame_count_ && frame_) {
    constexpr int kQuality = 80;  // of JPEG: no blocks are seen
    if (jpeg_.empty() && !picture_.empty()) jpeg_ = EncodeJpeg(picture_, kQuality);
    AddFrame(*frame_, names_, jpeg_, message);
  }
  cursor.map = map_;
  cursor.colors = colors_.size();
  cursor.groundtruth = groundtruth_count_;
  cursor.status = status_count_;
  cursor.frame = frame_count_;
  return std::move(message).Finish();
}

}  // namespace oaslam
