#include "oaslam/content/ar_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "oaslam/content/builtin_models.h"
#include "oaslam/content/overlay.h"
#include "oaslam/content/raster.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/anchor.h"

namespace oaslam {
namespace {

// A model placed on its anchor: the centre of its bottom is at the origin, and its longest side has
// the anchor's size.
struct Placed {
  const Mesh* mesh = nullptr;
  Rigid3 cam_from_anchor;
  double scale = 1;          // anchor units per mesh unit
  Eigen::Vector3d origin{};  // the anchor's origin in the mesh's frame
  Eigen::Vector3d sides{};   // in anchor units

  Eigen::Vector3d InCamera(const Eigen::Vector3f& position) const {
    return cam_from_anchor * (scale * (position.cast<double>() - origin));
  }
};

std::vector<Placed> PlaceContent(const ArFrame& frame, const ModelLibrary& models) {
  std::vector<Placed> content;
  for (const auto& [name, anchor] : frame.map->anchors) {
    const std::optional<Rigid3> world_from_anchor = WorldFromAnchor(*frame.map, anchor);
    if (!world_from_anchor || !(anchor.size > 0)) continue;
    Placed placed{.mesh = models.FindMesh(anchor.model),
                  .cam_from_anchor = *frame.cam_from_world * *world_from_anchor};
    if (!placed.mesh) placed.mesh = &PlaceholderModel();
    const MeshBounds bounds = BoundsOf(*placed.mesh);
    placed.scale = anchor.size / bounds.LongestSide();
    placed.origin = (0.5F * (bounds.min + bounds.max)).cast<double>();
    placed.origin.y() = bounds.min.y();
    placed.sides = placed.scale * (bounds.max - bounds.min).cast<double>();
    content.push_back(placed);
  }
  return content;
}

// The pixels around points; the whole picture if some but not all points are behind the camera.
cv::Rect PixelsAround(const std::vector<Eigen::Vector3d>& in_cam, double near, const Camera& camera,
                      const cv::Size& size) {
  const cv::Rect all({0, 0}, size);
  double left = std::numeric_limits<double>::max(), top = left, right = -left, bottom = -left;
  size_t behind = 0;
  for (const Eigen::Vector3d& p : in_cam) {
    if (p.z() < near) {
      ++behind;
      continue;
    }
    const Eigen::Vector2d pixel = ProjectIdeal(camera, p);
    left = std::min(left, pixel.x());
    right = std::max(right, pixel.x());
    top = std::min(top, pixel.y());
    bottom = std::max(bottom, pixel.y());
  }
  if (behind == in_cam.size()) return {};
  if (behind > 0) return all;
  const auto within = [](double value, int end) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(end)));
  };
  const int x1 = within(std::floor(left), size.width),
            x2 = within(std::ceil(right) + 1, size.width);
  const int y1 = within(std::floor(top), size.height),
            y2 = within(std::ceil(bottom) + 1, size.height);
  return {x1, y1, std::max(x2 - x1, 0), std::max(y2 - y1, 0)};
}

// The pixels of the box around a model, whose sides are enlarged by `margin`; of its floor only
// where `is_flat`.
cv::Rect PixelsOf(const Placed& placed, double margin, bool is_flat, double near,
                  const Camera& camera, const cv::Size& size) {
  std::vector<Eigen::Vector3d> corners;
  for (const double x : {-0.5, 0.5})
    for (const double y : {0.0, is_flat ? 0.0 : 1.0})
      for (const double z : {-0.5, 0.5})
        corners.push_back(
            placed.cam_from_anchor *
            Eigen::Vector3d(x * (1 + margin), y, z * (1 + margin)).cwiseProduct(placed.sides));
  return PixelsAround(corners, near, camera, size);
}

// The brightness, in [0, 1], of a surface with a normal in the anchor's frame, lit by a bright sky
// and a lamp above and ahead.
float LightOn(const Eigen::Vector3f& normal) {
  static const Eigen::Vector3f kLamp = Eigen::Vector3f(0.35F, 0.8F, 0.5F).normalized();
  return 0.40F + 0.12F * normal.y() + 0.55F * std::max(0.0F, normal.dot(kLamp));
}

void DrawModel(const Placed& placed, Raster& raster) {
  const Mesh& mesh = *placed.mesh;
  std::vector<Eigen::Vector3d> in_cam;
  in_cam.reserve(mesh.positions.size());
  for (const Eigen::Vector3f& p : mesh.positions) in_cam.push_back(placed.InCamera(p));
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = in_cam[triangle[0]], &b = in_cam[triangle[1]],
                          &c = in_cam[triangle[2]];
    // Selects the side of a sheet that faces the camera.
    const float side = (b - a).cross(c - a).dot(a) <= 0 ? 1.0F : -1.0F;
    std::array<Raster::Vertex, 3> vertices;
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t v = triangle[i];
      vertices[i] = {in_cam[v], LightOn(side * mesh.normals[v]) * mesh.colors[v]};
    }
    raster.Draw(vertices);
  }
}

// An ellipsoid that may hide content.
struct Occluder {
  Ellipsoid ellipsoid;
  EllipsoidFront front;
  Box outline;
};

// All mapped ellipsoids except those that content stands in: the ellipsoid of a table, for example,
// bulges over its top.
std::vector<Occluder> OccludersIn(const ArFrame& frame, const std::vector<Placed>& content) {
  // A point raised by this share of the content's size is outside of an ellipsoid that the content
  // stands on.
  constexpr double kRaised = 0.05;
  std::vector<Eigen::Vector3d> feet;
  const Rigid3 world_from_cam = frame.cam_from_world->Inverse();
  for (const Placed& placed : content)
    feet.push_back(world_from_cam * (placed.cam_from_anchor *
                                     Eigen::Vector3d(0, kRaised * placed.sides.maxCoeff(), 0)));
  std::vector<Occluder> occluders;
  frame.map->objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    if (std::ranges::any_of(feet,
                            [&](const auto& foot) { return Contains(object.ellipsoid, foot); }))
      return;
    // An ellipsoid around or beside the camera hides nothing.
    if (const auto outline = ProjectToBox(object.ellipsoid, *frame.cam_from_world, frame.camera))
      occluders.push_back(
          {object.ellipsoid, EllipsoidFront(object.ellipsoid, *frame.cam_from_world), *outline});
  });
  return occluders;
}

// A soft dark spot on the plane that a model stands on.
void DrawShadow(const Placed& placed, const std::vector<Occluder>& occluders, double near,
                const Camera& camera, cv::Mat& picture) {
  constexpr double kDarkness = 0.5, kMargin = 0.4;  // in its centre; beyond the model, of its sides
  const cv::Rect box = PixelsOf(placed, kMargin, true, near, camera, picture.size());
  const Rigid3 anchor_from_cam = placed.cam_from_anchor.Inverse();
  const double half_x = 0.5 * (1 + kMargin) * placed.sides.x(),
               half_z = 0.5 * (1 + kMargin) * placed.sides.z();
  if (!(half_x > 0) || !(half_z > 0)) return;
  const cv::Rect2d area = box;
  const Box around{area.x, area.y, area.br().x, area.br().y};
  std::vector<const EllipsoidFront*> fronts;
  for (const Occluder& occluder : occluders)
    if (Intersection(occluder.outline, around).Area() > 0) fronts.push_back(&occluder.front);
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x) {
      const Eigen::Vector3d ray = RayOf(camera, {x, y}), direction = anchor_from_cam.rotation * ray;
      const double depth = -anchor_from_cam.translation.y() / direction.y();
      if (!(depth > near)) continue;
      const Eigen::Vector3d at = anchor_from_cam.translation + depth * direction;
      const double distance = std::hypot(at.x() / half_x, at.z() / half_z);
      if (!(distance < 1)) continue;
      const bool is_hidden = std::ranges::any_of(fronts, [&](const EllipsoidFront* front) {
        const double before = front->DepthAlong(ray);
        return before > 0 && before < depth;
      });
      if (is_hidden) continue;
      const double fade = 1 - distance * distance;
      picture.at<cv::Vec3b>(y, x) *= 1 - kDarkness * fade * fade;
    }
}

}  // namespace

void DrawContent(const ArFrame& frame, const ModelLibrary& models, cv::Mat& picture) {
  if (!frame.cam_from_world || !frame.map) return;
  // The least depth that is drawn, of the smallest content's size: nearer, a triangle fills the
  // image.
  constexpr double kNear = 0.02;
  std::vector<Placed> content = PlaceContent(frame, models);
  double near = std::numeric_limits<double>::max();
  for (const Placed& placed : content) near = std::min(near, kNear * placed.sides.maxCoeff());
  cv::Rect area;
  for (const Placed& placed : content)
    area |= PixelsOf(placed, 0, false, near, frame.camera, picture.size());
  if (area.empty()) return;
  const std::vector<Occluder> occluders = OccludersIn(frame, content);
  for (const Placed& placed : content) DrawShadow(placed, occluders, near, frame.camera, picture);
  Raster raster(frame.camera, area, near);
  for (const Placed& placed : content) DrawModel(placed, raster);
  for (const Occluder& occluder : occluders)
    raster.HideBehind(occluder.ellipsoid, *frame.cam_from_world);
  raster.BlendInto(picture);
}

void DrawArPicture(const ArFrame& frame, const ModelLibrary& models, const ClassNames& names,
                   cv::Mat& picture) {
  // Outlines are drawn first, so that content in front of an object covers its outline, too.
  DrawOutlines(frame, names, picture);
  DrawContent(frame, models, picture);
  DrawStatus(frame, picture);
}

}  // namespace oaslam
