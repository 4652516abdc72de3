#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "oaslam/error.h"
#include "oaslam/exports/map_export.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {
namespace {

using Json = nlohmann::ordered_json;

template <typename Vector>
Json Numbers(const Vector& v) {
  Json numbers = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) numbers.push_back(v[i]);
  return numbers;
}

Json Pose(const Rigid3& pose) {
  const Eigen::Vector4d q = pose.rotation.w() < 0 ? Eigen::Vector4d(-pose.rotation.coeffs())
                                                  : Eigen::Vector4d(pose.rotation.coeffs());
  return {{"position", Numbers(pose.translation)}, {"rotation", Numbers(q)}};
}

// Rounds to a ten-thousandth of a pixel.
double Pixel(float value) { return std::round(static_cast<double>(value) * 1e4) / 1e4; }

Json Edges(unsigned char bits) {
  Json edges = Json::array();
  for (const auto& [bit, name] :
       {std::pair{kLeft, "left"}, {kTop, "top"}, {kRight, "right"}, {kBottom, "bottom"}})
    if (bits & bit) edges.push_back(name);
  return edges;
}

Json CameraJson(const Camera& c) {
  return {{"name", c.name},
          {"model", ToString(c.model)},
          {"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"distortion", c.distortion},
          {"is_guess", c.is_guess}};
}

Json KeyframeJson(KeyframeId id, const Keyframe& k, size_t recording) {
  Json keypoints = Json::array();
  for (const Keypoint& point : k.features->keypoints)
    keypoints.push_back({Pixel(point.px.x()), Pixel(point.px.y()), point.octave});
  return {{"id", id.value},
          {"frame_index", k.frame_index},
          {"recording", recording + 1},
          {"timestamp", k.timestamp},
          {"camera", k.camera},
          {"world_from_cam", Pose(k.cam_from_world.Inverse())},
          {"keypoints", std::move(keypoints)}};
}

Json LandmarkJson(LandmarkId id, const Landmark& landmark) {
  Json observations = Json::array();
  for (const Observation& o : landmark.observations)
    observations.push_back({o.keyframe.value, o.keypoint});
  return {{"id", id.value},
          {"position", Numbers(landmark.position)},
          {"observations", std::move(observations)}};
}

Json ObjectJson(ObjectId id, const Object& object, const SavedMap& saved) {
  Json boxes = Json::array();
  for (const ObjectObservation& o : object.observations) {
    const auto reference = saved.map.ResolvePose(o.reference);
    if (!reference) continue;
    boxes.push_back({{"frame_index", o.frame_index},
                     {"camera", o.camera},
                     {"world_from_cam", Pose((o.cam_from_reference * *reference).Inverse())},
                     {"box", {o.box.x1, o.box.y1, o.box.x2, o.box.y2}},
                     {"score", o.score},
                     {"truncated", Edges(o.truncated)}});
  }
  Json landmarks = Json::array(), covariance = Json::array();
  for (const LandmarkId landmark : object.landmarks)
    if (saved.map.landmarks.Contains(landmark)) landmarks.push_back(landmark.value);
  for (Eigen::Index i = 0; i < object.covariance.rows(); ++i)
    covariance.push_back(Numbers(Eigen::VectorXd(object.covariance.row(i))));
  const Ellipsoid& e = object.ellipsoid;
  Json json = {{"id", id.value},
               {"category_id", object.category_id},
               {"category", NameOf(saved.class_names, object.category_id)}};
  if (!object.name.empty()) json["name"] = object.name;
  json["state"] = ToString(object.state);
  if (object.state != ObjectState::kTentative) {
    json["center"] = Numbers(e.center);
    json["half_axes"] = Numbers(e.half_axes);
    json["rotation"] = Numbers(e.rotation.coeffs());
    json["covariance"] = std::move(covariance);
  }
  json["observations"] = object.total_observations;
  json["mean_iou"] = object.mean_iou;
  json["detection_rate"] = object.detection_rate;
  json["landmarks"] = std::move(landmarks);
  json["boxes"] = std::move(boxes);
  return json;
}

Json HeadJson(const SavedMap& saved) {
  Json json = {{"format", "oaslam-map"},
               {"version", 1},
               {"unit", saved.map.is_metric ? "metre" : "arbitrary"}};
  json["up"] = saved.map.up ? Numbers(*saved.map.up) : Json();
  json["class_names"] = Json::object();
  for (const auto& [category, name] : saved.class_names)
    json["class_names"][std::to_string(category)] = name;
  json["classes"] = {{"parts", Json::object()}, {"movable", saved.map.classes.movable}};
  for (const auto& [part, whole] : saved.map.classes.whole_of)
    json["classes"]["parts"][std::to_string(part)] = whole;
  json["recordings"] = Json::array();
  for (const MapRecording& r : saved.recordings)
    json["recordings"].push_back(
        {{"name", r.name}, {"images", r.images}, {"first_frame", r.first_frame}});
  json["cameras"] = Json::array();
  for (const Camera& camera : saved.map.cameras) json["cameras"].push_back(CameraJson(camera));
  return json;
}

// Writes a table with one element a line, so that the document of a large map is never in memory as
// a tree.
class List {
 public:
  List(std::string& text, const char* key) : text_(text) {
    text_ += fmt::format(",\n\"{}\":[", key);
  }
  ~List() { text_ += ']'; }
  List(const List&) = delete;
  List& operator=(const List&) = delete;
  void Add(const Json& element) {
    text_ += (is_empty_ ? "\n" : ",\n") + JsonText(element);
    is_empty_ = false;
  }

 private:
  std::string& text_;
  bool is_empty_ = true;
};

}  // namespace

void ExportJson(const std::string& path, const SavedMap& saved) {
  std::string text = JsonText(HeadJson(saved));
  text.pop_back();
  {
    List list(text, "keyframes");
    saved.map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
      list.Add(KeyframeJson(id, keyframe, RecordingOf(saved.recordings, keyframe.frame_index)));
    });
  }
  {
    List list(text, "landmarks");
    saved.map.landmarks.ForEach(
        [&](LandmarkId id, const Landmark& landmark) { list.Add(LandmarkJson(id, landmark)); });
  }
  {
    List list(text, "objects");
    saved.map.objects.ForEach(
        [&](ObjectId id, const Object& object) { list.Add(ObjectJson(id, object, saved)); });
  }
  {
    List list(text, "trajectory");
    for (const FramePose& frame : saved.trajectory)
      if (const auto reference = saved.map.ResolvePose(frame.reference)) {
        Json json = {{"frame_index", frame.frame_index},
                     {"recording", RecordingOf(saved.recordings, frame.frame_index) + 1},
                     {"timestamp", frame.timestamp},
                     {"state", ToString(frame.state)}};
        json.update(Pose((frame.cam_from_reference * *reference).Inverse()));
        list.Add(json);
      }
  }
  WriteTextFile(path, text + "}\n");
}

void ExportTum(const std::string& path, const SavedMap& saved) {
  std::vector<std::vector<StampedPose>> all = FinalTrajectories(saved);
  std::erase_if(all, [](const auto& poses) { return poses.empty(); });
  std::ranges::stable_sort(all, {}, [](const auto& poses) { return poses.front().timestamp; });
  std::vector<StampedPose> joined;
  for (const std::vector<StampedPose>& poses : all) {
    if (!joined.empty() && poses.front().timestamp <= joined.back().timestamp)
      throw InputError(
          fmt::format("{}: the map is of {} recordings whose times overlap: {}. Choose one by "
                      "--recording, or give --out a folder, for a file of each",
                      path, saved.recordings.size(), Describe(saved.recordings)));
    joined.insert(joined.end(), poses.begin(), poses.end());
  }
  SaveTrajectory(path, joined);
}

void ExportTumFiles(const std::string& folder, const SavedMap& saved) {
  const std::vector<std::vector<StampedPose>> all = FinalTrajectories(saved);
  for (size_t i = 0; i < all.size(); ++i)
    if (!all[i].empty())
      SaveTrajectory(fmt::format("{}/{}.txt", folder, FileNameOf(saved.recordings, i)), all[i]);
}

}  // namespace oaslam
