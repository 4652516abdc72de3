#include "oaslam/objects/occlusion.h"

#include <algorithm>
#include <cmath>

#include "oaslam/estimation/hidden_edges.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/parts.h"

namespace oaslam {
namespace {

struct Occluder {
  const Ellipsoid* ellipsoid;
  double radius;
};

// The largest distance from which a camera of the views looks at a point.
double FarthestView(const std::vector<BoxView>& views, const Eigen::Vector3d& point) {
  double farthest = 0;
  for (const BoxView& view : views)
    farthest = std::max(farthest, (view.cam_from_world * point).norm());
  return farthest;
}

}  // namespace

void MarkHiddenEdges(const Map& map, std::span<const ObjectPlace> places,
                     std::span<const ObjectId> own, const Ellipsoid& ellipsoid,
                     std::vector<BoxView>& views) {
  const int category = map.objects.At(own.front()).category_id;
  const double reach = FarthestView(views, ellipsoid.center) + ellipsoid.half_axes.maxCoeff();
  std::vector<Occluder> others;
  for (const ObjectPlace& place : places) {
    if (!place.is_mapped || (place.center - ellipsoid.center).norm() > reach + place.radius)
      continue;
    const Object* object = map.objects.Find(place.id);
    if (object && object->state == ObjectState::kMapped &&
        std::ranges::find(own, place.id) == own.end() &&
        !BelongTogether(map.classes, category, ellipsoid, object->category_id, object->ellipsoid))
      others.push_back({&object->ellipsoid, std::cbrt(object->ellipsoid.half_axes.prod())});
  }
  std::vector<Box> nearer;
  for (BoxView& view : views) {
    const double depth = (view.cam_from_world * ellipsoid.center).z();
    nearer.clear();
    for (const Occluder& other : others) {
      const double other_depth = (view.cam_from_world * other.ellipsoid->center).z();
      if (other_depth <= 0 || other_depth + other.radius > depth) continue;
      if (const auto box = ProjectToBox(*other.ellipsoid, view.cam_from_world, *view.camera))
        nearer.push_back(*box);
    }
    view.truncated |= HiddenEdges(view.box, nearer, DetectorPixel(*view.camera));
  }
}

}  // namespace oaslam
