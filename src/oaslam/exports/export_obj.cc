#include <fmt/format.h>

#include <filesystem>
#include <iterator>
#include <set>

#include "oaslam/exports/map_export.h"
#include "oaslam/exports/map_scene.h"
#include "oaslam/exports/top_view.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

// A name in an OBJ file ends at a blank.
std::string Word(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) <= ' ') c = '_';
  return text;
}

// Vertices are numbered from 1 through the whole file.
class ObjWriter {
 public:
  explicit ObjWriter(const Eigen::Matrix3d& y_up_from_world) : y_up_from_world_(y_up_from_world) {}

  void Begin(const std::string& name, const std::string& material) {
    fmt::format_to(out_, "o {}\nusemtl {}\n", Word(name), Word(material));
    base_ = vertices_;
  }
  void Vertex(const Eigen::Vector3d& x_in_world) {
    const Eigen::Vector3d x = y_up_from_world_ * x_in_world;
    fmt::format_to(out_, "v {:.7g} {:.7g} {:.7g}\n", x.x(), x.y(), x.z());
    ++vertices_;
  }
  void Normal(const Eigen::Vector3d& n_in_world) {
    const Eigen::Vector3d n = y_up_from_world_ * n_in_world.normalized();
    fmt::format_to(out_, "vn {:.5f} {:.5f} {:.5f}\n", n.x(), n.y(), n.z());
    ++normals_;
  }
  // `t` counts vertices from 0 since Begin; the normals follow in the same
  // order from `first_normal`.
  void Triangle(const std::array<uint32_t, 3>& t, size_t first_normal) {
    out_text_ += 'f';
    for (const uint32_t i : t) fmt::format_to(out_, " {}//{}", base_ + i + 1, first_normal + i + 1);
    out_text_ += '\n';
  }
  void Element(char kind, uint32_t begin, uint32_t end) {
    out_text_ += kind;
    for (uint32_t i = begin; i < end; ++i) fmt::format_to(out_, " {}", base_ + i + 1);
    out_text_ += '\n';
  }
  void Edge(uint32_t a, uint32_t b) {
    fmt::format_to(out_, "l {} {}\n", base_ + a + 1, base_ + b + 1);
  }

  size_t normals() const { return normals_; }
  const std::string& text() const { return out_text_; }

 private:
  Eigen::Matrix3d y_up_from_world_;
  std::string out_text_;
  std::back_insert_iterator<std::string> out_{out_text_};
  size_t vertices_ = 0, normals_ = 0, base_ = 0;
};

void WriteObjects(ObjWriter& obj, const std::vector<ExportedObject>& objects) {
  const TriangleMesh sphere = UnitSphere();
  for (const ExportedObject& o : objects) {
    const Ellipsoid& e = o.object->ellipsoid;
    obj.Begin(fmt::format("{}_{}", o.label, o.id.value),
              fmt::format("class_{}", o.object->category_id));
    const Eigen::Matrix3d axes = ScaledAxes(e);
    const size_t first_normal = obj.normals();
    for (const Eigen::Vector3d& v : sphere.vertices) obj.Vertex(e.center + axes * v);
    for (const Eigen::Vector3d& v : sphere.vertices)
      obj.Normal(e.rotation * v.cwiseQuotient(e.half_axes));
    for (const auto& triangle : sphere.triangles) obj.Triangle(triangle, first_normal);
  }
}

void WriteTrajectory(ObjWriter& obj, const SavedMap& saved) {
  const auto lines = TrajectoryLines(saved);
  if (lines.empty()) return;
  obj.Begin("trajectory", "trajectory");
  uint32_t first = 0;
  for (const auto& line : lines) {
    for (const StampedPose& pose : line) obj.Vertex(pose.world_from_cam.translation);
    const auto end = first + static_cast<uint32_t>(line.size());
    if (line.size() > 1) obj.Element('l', first, end);
    first = end;
  }
}

std::string Material(const std::string& name, const Rgb& color) {
  return fmt::format("newmtl {}\nKd {:.4f} {:.4f} {:.4f}\n", Word(name), color[0] / 255.0,
                     color[1] / 255.0, color[2] / 255.0);
}

}  // namespace

void ExportObj(const std::string& path, const SavedMap& saved) {
  const Map& map = saved.map;
  const std::vector<ExportedObject> objects = ExportedObjects(saved);
  ObjWriter obj(YUpFromWorld(map));
  WriteObjects(obj, objects);
  if (!map.landmarks.empty()) {
    obj.Begin("landmarks", "landmarks");
    uint32_t count = 0;
    map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
      obj.Vertex(landmark.position);
      ++count;
    });
    for (uint32_t i = 0; i < count; ++i) obj.Element('p', i, i + 1);
  }
  WriteTrajectory(obj, saved);
  const double depth = FrustumDepth(map);
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& keyframe) {
    obj.Begin(fmt::format("keyframe_{}", id.value), "keyframes");
    const Rigid3 world_from_cam = keyframe.cam_from_world.Inverse();
    for (const auto& corner :
         FrustumCorners(map.cameras[static_cast<size_t>(keyframe.camera)], depth))
      obj.Vertex(world_from_cam * corner);
    for (const auto& [a, b] : kFrustumEdges) obj.Edge(a, b);
  });

  std::string materials = Material("landmarks", kLandmarkColor) +
                          Material("trajectory", kTrajectoryColor) +
                          Material("keyframes", kKeyframeColor);
  std::set<int> classes;
  for (const ExportedObject& o : objects)
    if (classes.insert(o.object->category_id).second)
      materials += Material(fmt::format("class_{}", o.object->category_id), o.color);
  const std::filesystem::path material_path = std::filesystem::path(path).replace_extension(".mtl");
  WriteTextFile(path, fmt::format("# oaslam: right-handed, y up, lengths in {}\nmtllib {}\n{}",
                                  map.is_metric ? "metres" : "units of the map",
                                  material_path.filename().string(), obj.text()));
  WriteTextFile(material_path.string(), materials);
}

}  // namespace oaslam
