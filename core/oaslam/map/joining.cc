#include "oaslam/map/joining.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/util/check.h"

namespace oaslam {

void MoveObject(const Similarity& new_from_old, Object& object) {
  object.ellipsoid.center = new_from_old * object.ellipsoid.center;
  object.ellipsoid.half_axes *= new_from_old.scale;
  object.ellipsoid.rotation = (new_from_old.rotation * object.ellipsoid.rotation).normalized();
  const Eigen::Matrix3d turn = new_from_old.scale * new_from_old.rotation.toRotationMatrix();
  object.covariance.topRows<3>() = turn * object.covariance.topRows<3>().eval();
  object.covariance.leftCols<3>() = object.covariance.leftCols<3>().eval() * turn.transpose();
}

std::optional<Metre> MetreBy(const Map& other, const Similarity& world_from_other, const Map& map) {
  if (!other.is_metric || map.is_metric) return std::nullopt;
  return Metre{1 / world_from_other.scale, other.unit_evidence};
}

std::vector<int> CameraNumbers(const std::vector<Camera>& cameras, std::vector<Camera>& table) {
  std::vector<int> numbers;
  for (const Camera& camera : cameras) {
    const auto place = std::ranges::find(table, camera);
    numbers.push_back(static_cast<int>(place - table.begin()));
    if (place == table.end()) table.push_back(camera);
  }
  return numbers;
}

void NumberCameras(std::vector<Camera>& table, Map& map) {
  const std::vector<int> number = CameraNumbers(map.cameras, table);  // by the former one
  const auto changes = [&](int camera) { return number.at(static_cast<size_t>(camera)) != camera; };
  for (const KeyframeId id : map.keyframes.Ids())
    if (const int camera = map.keyframes.At(id).camera; changes(camera))
      map.keyframes.MutableAt(id).camera = number[static_cast<size_t>(camera)];
  for (const ObjectId id : map.objects.Ids()) {
    const auto& seen = map.objects.At(id).observations;
    if (std::ranges::none_of(seen, changes, &ObjectObservation::camera)) continue;
    for (ObjectObservation& o : map.objects.MutableAt(id).observations)
      o.camera = number[static_cast<size_t>(o.camera)];
  }
  map.cameras = table;
}

void JoinMap(const Map& joined, const Similarity& world_from_other, Map& map) {
  Map other = joined;
  NumberCameras(map.cameras, other);
  const Similarity other_from_world = world_from_other.Inverse();
  const double scale = world_from_other.scale;
  other.keyframes.ForEach([&](KeyframeId id, Keyframe keyframe) {
    keyframe.cam_from_world = (Similarity(keyframe.cam_from_world) * other_from_world).AsPose();
    keyframe.ScaleLengths(scale);
    map.keyframes.Insert(id, std::move(keyframe));
  });
  other.retired.ForEach([&](KeyframeId id, RetiredKeyframe retired) {
    retired.cam_from_parent.translation *= scale;
    map.retired.Insert(id, retired);
  });
  other.landmarks.ForEach([&](LandmarkId id, Landmark landmark) {
    landmark.position = world_from_other * landmark.position;
    landmark.normal = world_from_other.rotation * landmark.normal;
    landmark.min_distance *= static_cast<float>(scale);
    landmark.max_distance *= static_cast<float>(scale);
    map.landmarks.Insert(id, std::move(landmark));
  });
  other.objects.ForEach([&](ObjectId id, Object object) {
    MoveObject(world_from_other, object);
    for (ObjectObservation& o : object.observations) o.ScaleLengths(scale);
    map.objects.Insert(id, std::move(object));
  });
  other.merged_objects.ForEach(
      [&](ObjectId id, ObjectId into) { map.merged_objects.Insert(id, into); });
  for (auto [name, anchor] : other.anchors) {
    anchor.Scale(scale);
    std::string free_name = name;
    for (int i = 2; map.anchors.contains(free_name); ++i)
      free_name = fmt::format("{} ({})", name, i);
    map.anchors.emplace(std::move(free_name), std::move(anchor));
  }
  map.loops_closed += other.loops_closed;
  if (other.up && (!map.up || other.up_keyframes > map.up_keyframes)) {
    map.up = world_from_other.rotation * *other.up;
    map.up_keyframes = other.up_keyframes;
  }
  map.next_landmark = std::max(map.next_landmark, other.next_landmark);
}

}  // namespace oaslam
