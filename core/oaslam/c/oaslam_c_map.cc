#include <algorithm>
#include <mutex>
#include <utility>
#include <vector>

#include "oaslam/c/handles.h"
#include "oaslam/c/values.h"
#include "oaslam/export_map.h"
#include "oaslam/map_editing.h"
#include "oaslam/oaslam_c.h"

using namespace oaslam;     // NOLINT: all below are functions of C
using namespace oaslam::c;  // NOLINT

namespace {

// An array of a map, made by fill(map) with the first call. Null where memory runs out.
template <typename Element, typename Fill>
const Element* Array(const oaslam_map* handle, std::once_flag oaslam_map::*flag,
                     std::vector<Element> oaslam_map::*array, size_t* count, Fill&& fill) noexcept {
  if (count) *count = 0;
  if (!handle) return nullptr;
  auto& map = const_cast<oaslam_map&>(*handle);  // all handles are made by us, and not const
  const oaslam_status status = Call([&] { std::call_once(map.*flag, [&] { fill(map); }); });
  const std::vector<Element>& made = map.*array;
  if (status != OASLAM_OK || made.empty()) return nullptr;
  if (count) *count = made.size();
  return made.data();
}

oaslam_object ObjectOf(const MapSnapshot::Object& o) {
  oaslam_object c{};
  c.id = o.id.value;
  c.category_id = o.category_id;
  c.name = o.name.c_str();
  Copy(o.ellipsoid.center, c.center);
  Copy(o.ellipsoid.half_axes, c.half_axes);
  Copy(o.ellipsoid.rotation.coeffs(), c.rotation);
  c.observations = o.observations;
  c.has_moved = o.has_moved;
  return c;
}

oaslam_anchor AnchorOf(const AnchorPose& a) {
  oaslam_anchor c{};
  c.name = a.name.c_str();
  c.model = a.model.c_str();
  c.size = a.size;
  c.world_from_anchor = PoseOf(a.world_from_anchor);
  c.is_on_object = a.object.has_value();
  if (a.object) c.object = a.object->value;
  return c;
}

}  // namespace

oaslam_status oaslam_map_load(const char* path, oaslam_map** map) {
  return Call([&] { *map = new oaslam_map(MapSnapshot::Load(path)); }, path, map);
}

void oaslam_map_destroy(oaslam_map* map) { delete map; }

oaslam_status oaslam_map_save(const oaslam_map* map, const char* path) {
  return Call([&] { map->map.Save(path); }, map, path);
}

oaslam_status oaslam_map_to_bytes(oaslam_map* map, const uint8_t** bytes, size_t* count) {
  return Call(
      [&] {
        std::call_once(map->has_bytes, [&] { map->bytes = map->map.ToBytes(); });
        *bytes = reinterpret_cast<const uint8_t*>(map->bytes.data());
        *count = map->bytes.size();
      },
      map, bytes, count);
}

oaslam_status oaslam_map_from_bytes(const uint8_t* bytes, size_t count, oaslam_map** map) {
  return Call(
      [&] {
        *map =
            new oaslam_map(MapSnapshot::FromBytes({reinterpret_cast<const char*>(bytes), count}));
      },
      bytes, map);
}

uint32_t oaslam_map_world(const oaslam_map* map) { return map ? map->map.world().value : 0; }

int32_t oaslam_map_is_metric(const oaslam_map* map) { return map && map->map.is_metric(); }

double oaslam_map_unit_sigma(const oaslam_map* map) { return map ? map->map.unit_sigma() : 0; }

int32_t oaslam_map_up(const oaslam_map* map, double up[3]) {
  const auto known = map && up ? map->map.up() : std::nullopt;
  if (known) std::copy_n(known->data(), 3, up);
  return known.has_value();
}

oaslam_status oaslam_map_estimate_scale(const oaslam_map* map, oaslam_scale_estimate* estimate) {
  return Call(
      [&] {
        const ScaleEstimate scale = map->map.EstimateScale();
        if (!scale.success) return Failed(OASLAM_REFUSED, scale.why_not.c_str());
        *estimate = {scale.metres_per_unit, scale.relative_sigma, scale.objects, scale.classes};
        return OASLAM_OK;
      },
      map, estimate);
}

oaslam_status oaslam_map_cast(const oaslam_map* map, const double origin[3],
                              const double direction[3], oaslam_ray_hit* hits, size_t most,
                              size_t* count) {
  return Call(
      [&] {
        Write(map->map.Cast(Eigen::Vector3d(origin), Eigen::Vector3d(direction)), hits, most, count,
              HitOf);
      },
      map, origin, direction, count);
}

oaslam_status oaslam_map_edit_object(const oaslam_map* map, uint32_t object,
                                     const oaslam_object_edit* edit, oaslam_map** edited) {
  return Call(
      [&] { *edited = new oaslam_map(EditObject(map->map, ObjectId(object), EditOf(*edit))); }, map,
      edit, edited);
}

oaslam_status oaslam_map_merge(const oaslam_map* first, const oaslam_map* second,
                               oaslam_map** merged) {
  return Call(
      [&] {
        MergedMaps both = MergeMaps(first->map, second->map);
        if (!both.map) return Failed(OASLAM_REFUSED, both.evidence.c_str());
        *merged = new oaslam_map(*std::move(both.map));
        return OASLAM_OK;
      },
      first, second, merged);
}

oaslam_status oaslam_map_export(const oaslam_map* map, oaslam_map_format format, const char* path) {
  return Call([&] { ExportMap(map->map, static_cast<MapFormat>(format), path); }, map, path);
}

const oaslam_object* oaslam_map_objects(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_objects, &oaslam_map::objects, count, [](oaslam_map& m) {
    m.objects.clear();  // of a call that ran out of memory
    m.named_objects = m.map.Objects().ToVector();
    for (const MapSnapshot::Object& o : m.named_objects) m.objects.push_back(ObjectOf(o));
  });
}

const oaslam_anchor* oaslam_map_anchors(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_anchors, &oaslam_map::anchors, count, [](oaslam_map& m) {
    m.anchors.clear();
    m.named_anchors = m.map.Anchors();
    for (const AnchorPose& a : m.named_anchors) m.anchors.push_back(AnchorOf(a));
  });
}

const oaslam_landmark* oaslam_map_landmarks(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_landmarks, &oaslam_map::landmarks, count, [](oaslam_map& m) {
    m.landmarks.clear();
    for (const MapSnapshot::Landmark& l : m.map.Landmarks())
      m.landmarks.push_back(
          {l.id.value, {l.position.x(), l.position.y(), l.position.z()}, l.observations});
  });
}

const oaslam_keyframe* oaslam_map_keyframes(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_keyframes, &oaslam_map::keyframes, count, [](oaslam_map& m) {
    m.keyframes.clear();
    for (const MapSnapshot::Keyframe& k : m.map.Keyframes())
      m.keyframes.push_back({k.id.value, k.timestamp, PoseOf(k.world_from_cam)});
  });
}

const oaslam_stamped_pose* oaslam_map_trajectory(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_trajectory, &oaslam_map::trajectory, count, [](oaslam_map& m) {
    m.trajectory.clear();
    for (const StampedPose& pose : m.map.Trajectory()) m.trajectory.push_back(StampedPoseOf(pose));
  });
}

const oaslam_class_name* oaslam_map_class_names(const oaslam_map* map, size_t* count) {
  return Array(map, &oaslam_map::has_class_names, &oaslam_map::class_names, count,
               [](oaslam_map& m) {
                 m.class_names.clear();
                 for (const auto& [category, name] : m.map.CategoryNames())
                   m.class_names.push_back({category, name.c_str()});
               });
}

oaslam_status oaslam_localizer_create(const oaslam_map* map, oaslam_localizer** localizer) {
  return Call([&] { *localizer = new oaslam_localizer{MapLocalizer(map->map)}; }, map, localizer);
}

void oaslam_localizer_destroy(oaslam_localizer* localizer) { delete localizer; }

oaslam_status oaslam_localizer_relocalize(const oaslam_localizer* localizer,
                                          const oaslam_image* image,
                                          const oaslam_relocalize_options* options,
                                          oaslam_relocalization* found) {
  return Call(
      [&] {
        const auto result = localizer->localizer.Relocalize(InputOf(*image), OptionsOf(options));
        *found = RelocalizationOf(result);
        return Failed(OASLAM_OK, result.why_not.c_str());
      },
      localizer, image, found);
}
