#include <fmt/format.h>

#include <cmath>

#include "oaslam/exports/gltf_buffer.h"
#include "oaslam/exports/map_export.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/util/srgb.h"

namespace oaslam {
namespace {

using Json = GltfBuffer::Json;

enum PrimitiveMode { kPoints = 0, kLines = 1, kTriangles = 4 };

Json RotationOf(const Eigen::Quaterniond& q) { return JsonNumbers<Json>(q.normalized().coeffs()); }

// A glTF camera looks along -z with y up: OpenCV's frame rotated by 180 degrees about x.
const Eigen::Quaterniond kCvFromGl(0, 1, 0, 0);

double Linear(unsigned char srgb) { return LinearFromSrgb(srgb / 255.0); }

// All nodes are children of the node "map", which rotates the frame of the map to y up, so that
// their numbers are those of the map.
class Document {
 public:
  explicit Document(const SavedMap& saved) : saved_(saved), objects_(ExportedObjects(saved)) {
    nodes_.push_back({{"name", "map"},
                      {"rotation", RotationOf(Eigen::Quaterniond(YUpFromWorld(saved.map)))},
                      {"extras", {{"unit", saved.map.is_metric ? "metre" : "arbitrary"}}}});
  }

  void AddObjects();
  void AddLandmarks();
  void AddTrajectory();
  void AddKeyframes();
  void AddAnimations();
  void Save(const std::string& path);

 private:
  size_t AddMaterial(const std::string& name, const Rgb& color, bool is_surface);
  size_t AddMesh(const std::string& name, Json primitive);
  int CameraOf(size_t recording) const;
  void AddNode(Json node);

  const SavedMap& saved_;
  std::vector<ExportedObject> objects_;
  GltfBuffer buffer_;
  Json nodes_ = Json::array(), children_ = Json::array(), meshes_ = Json::array(),
       materials_ = Json::array(), cameras_ = Json::array(), animations_ = Json::array();
};

size_t Document::AddMaterial(const std::string& name, const Rgb& color, bool is_surface) {
  const Json rgba = {Linear(color[0]), Linear(color[1]), Linear(color[2]), is_surface ? 0.6 : 1.0};
  Json material = {{"name", name},
                   {"pbrMetallicRoughness",
                    {{"baseColorFactor", rgba}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}}}};
  if (is_surface)
    material["alphaMode"] = "BLEND";
  else
    material["extensions"] = {{"KHR_materials_unlit", Json::object()}};
  materials_.push_back(std::move(material));
  return materials_.size() - 1;
}

size_t Document::AddMesh(const std::string& name, Json primitive) {
  meshes_.push_back({{"name", name}, {"primitives", {std::move(primitive)}}});
  return meshes_.size() - 1;
}

void Document::AddNode(Json node) {
  children_.push_back(nodes_.size());
  nodes_.push_back(std::move(node));
}

void Document::AddObjects() {
  if (objects_.empty()) return;
  const TriangleMesh sphere = UnitSphere();
  std::vector<uint32_t> indices;
  for (const auto& triangle : sphere.triangles)
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  const int positions = buffer_.AddVectors(sphere.vertices), faces = buffer_.AddIndices(indices);
  std::map<int, size_t> mesh_of_class;
  for (const ExportedObject& o : objects_) {
    const int category = o.object->category_id;
    const std::string class_name = NameOf(saved_.class_names, category);
    if (!mesh_of_class.contains(category))
      // The normals of the unit sphere equal its positions.
      mesh_of_class[category] =
          AddMesh(class_name, {{"attributes", {{"POSITION", positions}, {"NORMAL", positions}}},
                               {"indices", faces},
                               {"mode", kTriangles},
                               {"material", AddMaterial(class_name, o.color, true)}});
    const Ellipsoid& e = o.object->ellipsoid;
    AddNode({{"name", fmt::format("{} {}", o.label, o.id.value)},
             {"mesh", mesh_of_class[category]},
             {"translation", JsonNumbers<Json>(e.center)},
             {"rotation", RotationOf(e.rotation)},
             {"scale", JsonNumbers<Json>(e.half_axes)},
             {"extras",
              {{"id", o.id.value},
               {"category_id", category},
               {"category", class_name},
               {"observations", o.object->total_observations}}}});
  }
}

void Document::AddLandmarks() {
  std::vector<Eigen::Vector3d> points;
  saved_.map.landmarks.ForEach(
      [&](LandmarkId, const Landmark& landmark) { points.push_back(landmark.position); });
  if (points.empty()) return;
  const size_t mesh =
      AddMesh("landmarks", {{"attributes", {{"POSITION", buffer_.AddVectors(points)}}},
                            {"mode", kPoints},
                            {"material", AddMaterial("landmarks", kLandmarkColor, false)}});
  AddNode({{"name", "landmarks"}, {"mesh", mesh}});
}

void Document::AddTrajectory() {
  std::vector<Eigen::Vector3d> points;
  std::vector<uint32_t> indices;
  for (const auto& line : TrajectoryLines(saved_))
    for (size_t i = 0; i < line.size(); ++i) {
      const auto last = static_cast<uint32_t>(points.size());
      if (i > 0) indices.insert(indices.end(), {last - 1, last});
      points.push_back(line[i].world_from_cam.translation);
    }
  if (indices.empty()) return;
  const int positions = buffer_.AddVectors(points), lines = buffer_.AddIndices(indices);
  const size_t mesh =
      AddMesh("trajectory", {{"attributes", {{"POSITION", positions}}},
                             {"indices", lines},
                             {"mode", kLines},
                             {"material", AddMaterial("trajectory", kTrajectoryColor, false)}});
  AddNode({{"name", "trajectory"}, {"mesh", mesh}});
}

void Document::AddKeyframes() {
  if (saved_.map.keyframes.empty()) return;
  const double depth = FrustumDepth(saved_.map);
  const size_t material = AddMaterial("keyframes", kKeyframeColor, false),
               first_mesh = meshes_.size();
  std::vector<uint32_t> edges;
  for (const auto& edge : kFrustumEdges) edges.insert(edges.end(), edge.begin(), edge.end());
  const int lines = buffer_.AddIndices(edges);
  for (const Camera& camera : saved_.map.cameras) {
    std::vector<Eigen::Vector3d> corners;
    for (const Eigen::Vector3d& corner : FrustumCorners(camera, depth))
      corners.push_back(kCvFromGl.conjugate() * corner);
    AddMesh("frustum", {{"attributes", {{"POSITION", buffer_.AddVectors(corners)}}},
                        {"indices", lines},
                        {"mode", kLines},
                        {"material", material}});
    cameras_.push_back(
        {{"type", "perspective"},
         {"perspective",
          {{"aspectRatio", camera.width * camera.fy / (camera.height * camera.fx)},
           {"yfov", 2 * std::atan(camera.height / (2 * camera.fy))},
           {"znear", 0.02 * depth}}},
         {"extras", {{"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}}}});
  }
  saved_.map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    const Rigid3 world_from_cam = keyframe.cam_from_world.Inverse();
    AddNode({{"name", fmt::format("keyframe {}", id.value)},
             {"camera", keyframe.camera},
             {"mesh", first_mesh + static_cast<size_t>(keyframe.camera)},
             {"translation", JsonNumbers<Json>(world_from_cam.translation)},
             {"rotation", RotationOf(world_from_cam.rotation * kCvFromGl)},
             {"extras", {{"timestamp", keyframe.timestamp}}}});
  });
}

// That of the recording's first keyframe.
int Document::CameraOf(size_t recording) const {
  std::optional<int> camera;
  saved_.map.keyframes.ForEach([&](KeyframeId, const Keyframe& keyframe) {
    if (!camera && RecordingOf(saved_.recordings, keyframe.frame_index) == recording)
      camera = keyframe.camera;
  });
  return camera.value_or(0);
}

void Document::AddAnimations() {
  if (cameras_.empty()) return;
  const auto trajectories = FinalTrajectories(saved_);
  for (size_t i = 0; i < trajectories.size(); ++i) {
    std::vector<double> times;
    std::vector<Eigen::Vector3d> positions;
    std::vector<Eigen::Quaterniond> rotations;
    for (const StampedPose& pose : trajectories[i]) {
      // Times are floats, of which two must differ.
      const double time = pose.timestamp - trajectories[i].front().timestamp;
      if (!times.empty() && !(static_cast<float>(time) > static_cast<float>(times.back())))
        continue;
      times.push_back(time);
      positions.push_back(pose.world_from_cam.translation);
      rotations.emplace_back(Eigen::Quaterniond(pose.world_from_cam.rotation) * kCvFromGl);
      // The shorter way to it is the one that the camera took.
      if (rotations.size() > 1 && rotations.back().dot(rotations[rotations.size() - 2]) < 0)
        rotations.back().coeffs() *= -1;
    }
    if (times.size() < 2) continue;
    const std::string name =
        trajectories.size() > 1 ? "camera " + FileNameOf(saved_.recordings, i) : "camera";
    const int input = buffer_.AddTimes(times);
    const Json samplers = {{{"input", input}, {"output", buffer_.AddPositions(positions)}},
                           {{"input", input}, {"output", buffer_.AddRotations(rotations)}}};
    const auto channel = [&](int sampler, const char* path) {
      return Json{{"sampler", sampler}, {"target", {{"node", nodes_.size()}, {"path", path}}}};
    };
    animations_.push_back({{"name", name},
                           {"channels", {channel(0, "translation"), channel(1, "rotation")}},
                           {"samplers", samplers}});
    AddNode({{"name", name},
             {"camera", CameraOf(i)},
             {"translation", JsonNumbers<Json>(positions.front())},
             {"rotation", RotationOf(rotations.front())}});
  }
}

void Document::Save(const std::string& path) {
  if (!children_.empty()) nodes_[0]["children"] = children_;
  Json document = {{"asset", {{"version", "2.0"}, {"generator", "oaslam"}}},
                   {"scene", 0},
                   {"scenes", {{{"nodes", {0}}}}},
                   {"nodes", nodes_}};
  for (const Json& material : materials_)
    if (material.contains("extensions")) document["extensionsUsed"] = {"KHR_materials_unlit"};
  const auto set = [&](const char* key, const Json& list) {
    if (!list.empty()) document[key] = list;
  };
  set("meshes", meshes_);
  set("materials", materials_);
  set("cameras", cameras_);
  set("animations", animations_);
  SaveGltf(path, std::move(document), buffer_);
}

}  // namespace

void ExportGltf(const std::string& path, const SavedMap& saved) {
  Document document(saved);
  document.AddObjects();
  document.AddLandmarks();
  document.AddTrajectory();
  document.AddKeyframes();
  document.AddAnimations();
  document.Save(path);
}

}  // namespace oaslam
