#include "oaslam/map/anchor.h"

#include "oaslam/map/map.h"

namespace oaslam {

bool Anchor::operator==(const Anchor& other) const {
  return model == other.model && size == other.size && keyframe == other.keyframe &&
         object == other.object && offset == other.offset &&
         cam_from_anchor.translation == other.cam_from_anchor.translation &&
         cam_from_anchor.rotation.coeffs() == other.cam_from_anchor.rotation.coeffs();
}

std::optional<Rigid3> WorldFromAnchor(const Map& map, const Anchor& anchor) {
  const std::optional<Rigid3> cam_from_world = map.ResolvePose(anchor.keyframe);
  if (!cam_from_world) return std::nullopt;
  const Rigid3 world_from_cam = cam_from_world->Inverse();
  Rigid3 world_from_anchor = world_from_cam * anchor.cam_from_anchor;
  if (!anchor.object.IsValid()) return world_from_anchor;
  const std::optional<ObjectId> now = map.ResolveObject(anchor.object);
  const Object* object = now ? map.objects.Find(*now) : nullptr;
  if (object && object->state != ObjectState::kTentative)
    world_from_anchor.translation =
        object->ellipsoid.center + world_from_cam.rotation * anchor.offset;
  return world_from_anchor;
}

}  // namespace oaslam
