#include "oaslam/map/camera_replacement.h"

#include <map>
#include <memory>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// The inverse of UndistortBox. An edge depends on the others only through their midpoint, so that
// few rounds suffice.
Box DistortBox(const Camera& camera, const Box& ideal) {
  constexpr int kRounds = 5;
  Box raw = ideal;
  for (int round = 0; round < kRounds; ++round) {
    const double x = (raw.x1 + raw.x2) / 2 - 0.5, y = (raw.y1 + raw.y2) / 2 - 0.5;
    const auto left = Undistort(camera, {raw.x1 - 0.5, y}),
               right = Undistort(camera, {raw.x2 - 0.5, y});
    const auto top = Undistort(camera, {x, raw.y1 - 0.5}),
               bottom = Undistort(camera, {x, raw.y2 - 0.5});
    raw = {Distort(camera, {ideal.x1 - 0.5, left.y()}).x() + 0.5,
           Distort(camera, {top.x(), ideal.y1 - 0.5}).y() + 0.5,
           Distort(camera, {ideal.x2 - 0.5, right.y()}).x() + 0.5,
           Distort(camera, {bottom.x(), ideal.y2 - 0.5}).y() + 0.5};
  }
  return raw;
}

}  // namespace

Features WithCamera(const Features& features, const Camera& old, const Camera& replacement) {
  Features changed = features;
  for (Keypoint& k : changed.keypoints)
    k.px = Undistort(replacement, Distort(old, k.px.cast<double>())).cast<float>();
  changed.bounds = IdealImageBounds(replacement);
  changed.BuildGrid();
  return changed;
}

Map WithCamera(const Map& map, int camera, const Camera& replacement) {
  const Camera& old = map.cameras.at(static_cast<size_t>(camera));
  // By index: the replacement.
  std::map<int, Camera> replaced{{camera, replacement}};
  for (int i = 0; i < static_cast<int>(map.cameras.size()); ++i) {
    const auto zoom = ZoomBetween(old, map.cameras[static_cast<size_t>(i)]);
    if (i != camera && zoom) replaced.emplace(i, Zoomed(replacement, *zoom));
  }
  Map changed = map;
  for (const auto& [index, by] : replaced) changed.cameras[static_cast<size_t>(index)] = by;
  for (const KeyframeId id : map.keyframes.Ids()) {
    const Keyframe& before = map.keyframes.At(id);
    const auto by = replaced.find(before.camera);
    if (by == replaced.end() || !before.features) continue;
    changed.keyframes.MutableAt(id).features = std::make_shared<const Features>(
        WithCamera(*before.features, map.cameras[static_cast<size_t>(before.camera)], by->second));
  }
  for (const ObjectId id : map.objects.Ids())
    for (ObjectObservation& o : changed.objects.MutableAt(id).observations)
      if (const auto by = replaced.find(o.camera); by != replaced.end())
        o.box =
            UndistortBox(by->second, DistortBox(map.cameras[static_cast<size_t>(o.camera)], o.box));
  return changed;
}

}  // namespace oaslam
