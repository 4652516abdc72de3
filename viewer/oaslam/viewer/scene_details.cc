#include <algorithm>
#include <memory>

#include "oaslam/viewer/frame_message.h"
#include "oaslam/viewer/map_delta.h"
#include "oaslam/viewer/scene.h"

namespace oaslam {
namespace {

using nlohmann::json;

json DescribeObservation(const Map& map, const ObjectObservation& o) {
  json entry{{"frame", o.frame_index},
             {"score", o.score},
             {"box", {o.box.x1, o.box.y1, o.box.x2, o.box.y2}},
             {"truncated", o.truncated != 0}};
  if (const auto reference = map.ResolvePose(o.reference)) {
    const Eigen::Vector3d from = (o.cam_from_reference * *reference).OriginInSource();
    entry["camera"] = {from.x(), from.y(), from.z()};
  }
  return entry;
}

}  // namespace

std::optional<std::string> Scene::DescribeObject(ObjectId id) const {
  const Object* object = map_ ? map_->objects.Find(id) : nullptr;
  if (!object) return std::nullopt;
  MessageBuilder message("object");
  message.header["object"] = oaslam::DescribeObject(id, *object, names_);
  json covariance = json::array();  // of centre and log half axes, by rows
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 7; ++column)
      covariance.push_back(object->covariance(row, column));
  message.header["covariance"] = std::move(covariance);
  message.header["detection_rate"] = object->detection_rate;
  message.header["landmarks"] = object->landmarks.size();
  json observations = json::array();
  for (const ObjectObservation& o : object->observations)
    observations.push_back(DescribeObservation(*map_, o));
  message.header["observations"] = std::move(observations);
  json crops = json::array();
  std::vector<uint8_t> jpegs;
  for (const Crops::Crop& crop : crops_.Of(id)) {
    crops.push_back({{"frame", crop.frame}, {"bytes", crop.jpeg.size()}});
    jpegs.insert(jpegs.end(), crop.jpeg.begin(), crop.jpeg.end());
  }
  message.header["crops"] = std::move(crops);
  message.Add("jpegs", jpegs);
  return std::move(message).Finish();
}

std::optional<std::string> Scene::DescribeKeyframe(KeyframeId id) const {
  const Keyframe* keyframe = map_ ? map_->keyframes.Find(id) : nullptr;
  if (!keyframe) return std::nullopt;
  FrameRecord record;
  TrackingResult& result = record.result;
  result.frame = keyframe->frame_index;
  result.timestamp = keyframe->timestamp;
  result.state = TrackingState::kTracking;
  const auto note = std::ranges::lower_bound(notes_, keyframe->frame_index, {}, &FrameNote::frame);
  if (note != notes_.end() && note->frame == keyframe->frame_index) {
    result.timestamp = note->timestamp;
    result.state = note->state;
    result.ms_total = note->ms_total;
  }
  result.SetPose(keyframe->cam_from_world.Inverse());
  record.view.map = map_;
  record.view.frame = {
      keyframe->frame_index,
      keyframe->timestamp,
      std::make_shared<const Camera>(map_->cameras[static_cast<size_t>(keyframe->camera)]),
      keyframe->features,
      {}};
  record.view.landmarks = keyframe->landmarks;
  result.keypoints = static_cast<int>(keyframe->landmarks.size());
  result.matched = static_cast<int>(std::ranges::count_if(
      keyframe->landmarks, [](LandmarkId landmark) { return landmark.IsValid(); }));
  result.inliers = result.matched;
  map_->objects.ForEach([&](ObjectId object_id, const Object& object) {
    for (const ObjectObservation& o : object.observations)
      if (o.frame_index == keyframe->frame_index && object.state == ObjectState::kMapped) {
        record.view.frame.detections.push_back({object.category_id, o.score, o.box, o.truncated});
        record.view.detected.push_back(object_id);
        ++result.objects;
      }
  });
  MessageBuilder message("keyframe");
  message.header["keyframe"] = id.value;
  const auto picture = pictures_.find(keyframe->frame_index);
  AddFrame(record, names_, picture == pictures_.end() ? std::vector<uint8_t>{} : picture->second,
           message);
  return std::move(message).Finish();
}

}  // namespace oaslam
