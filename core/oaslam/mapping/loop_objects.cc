#include "oaslam/mapping/loop_objects.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/joining.h"

namespace oaslam {
namespace {

// The values of this file were chosen by these reasons, not measured.
constexpr int kGroup = 10;  // keyframes around an end: they see it from several sides

// An image in which objects were detected, mapped or not.
struct Shot {
  KeyframeId keyframe;  // in the map; the image was tracked from it, or from one that was culled
  Rigid3 cam_from_world;
  int camera = 0;
  std::vector<std::pair<const Object*, Box>> boxes;  // and what they show
};

// The detections around one end of the loop.
struct End {
  std::map<int, Shot> shots;   // by frame
  std::set<ObjectId> objects;  // mapped ones
};

End LookAround(const Map& map, KeyframeId keyframe) {
  const std::vector<KeyframeId> group = map.KeyframesAround(keyframe, kGroup);
  End end;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    for (const ObjectObservation& o : object.observations) {
      const auto carried = map.ResolveKeyframe(o.reference);
      if (!carried || std::ranges::find(group, carried->by) == group.end()) continue;
      Shot& shot = end.shots[o.frame_index];
      shot.keyframe = carried->by;
      const Rigid3 reference_from_world =
          carried->cam_from_carrier * map.keyframes.At(carried->by).cam_from_world;
      shot.cam_from_world = o.cam_from_reference * reference_from_world;
      shot.camera = o.camera;
      shot.boxes.emplace_back(&object, o.box);
      if (object.state == ObjectState::kMapped) end.objects.insert(id);
    }
  });
  return end;
}

// Whether more than half of the landmarks that the keyframe sees where the object would be are
// nearer than the object, as on a wall in front of it. Also true where the keyframe cannot see that
// place. The keyframe stands for the images near it.
bool IsBehindLandmarks(const Map& map, const Keyframe& keyframe, const Ellipsoid& ellipsoid) {
  const auto box = ProjectToBox(ellipsoid, keyframe.cam_from_world, map.cameras[keyframe.camera]);
  if (!box) return true;
  const double depth = (keyframe.cam_from_world * ellipsoid.center).z();
  int nearer = 0, all = 0;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark = map.landmarks.Find(keyframe.landmarks[i]);
    const Eigen::Vector2f& px = keyframe.features->keypoints[i].px;
    if (!landmark || px.x() < box->x1 || px.x() > box->x2 || px.y() < box->y1 || px.y() > box->y2)
      continue;
    ++all;
    nearer +=
        (keyframe.cam_from_world * landmark->position).z() < depth - ellipsoid.half_axes.maxCoeff();
  }
  return 2 * nearer > all;
}

enum class Showing { kNothing, kObject, kNoObject };

// Whether an image shows an object with these labels in this place; kNothing where it would be
// small, cut or hidden.
Showing Judge(const Map& map, const Shot& shot, const LabelsRef& labels,
              const Ellipsoid& ellipsoid) {
  constexpr double kLeastSize = 40;  // detector pixels: detectors miss smaller objects more often
  // A wrong veto loses a right loop. So what counts as missing is strict (least share of the box in
  // the image, most of it in the box of another object), and what counts as seen is generous (least
  // IoU with the box of its class: ellipsoids of few views and drift displace the box).
  constexpr double kInside = 0.95, kHidden = 0.2, kSameBox = 0.1;
  const Camera& camera = map.cameras[shot.camera];
  const Keyframe& keyframe = map.keyframes.At(shot.keyframe);
  const auto box = ProjectToBox(ellipsoid, shot.cam_from_world, camera);
  if (!box || ShareInside(*box, keyframe.features->bounds) < kInside) return Showing::kNothing;
  for (const auto& [object, seen] : shot.boxes)
    if (MayBeTheSame(LabelsOf(*object), labels) && IoU(seen, *box) > kSameBox)
      return Showing::kObject;
  const bool may_be_hidden = std::ranges::any_of(
      shot.boxes, [&](const auto& seen) { return ShareInside(*box, seen.second) > kHidden; });
  if (SizeOf(*box) < kLeastSize * DetectorPixel(camera) || may_be_hidden ||
      IsBehindLandmarks(map, keyframe, ellipsoid))
    return Showing::kNothing;
  return Showing::kNoObject;
}

// Compares the objects of one end, moved by `motion`, with the images of the other end.
void Compare(const Map& map, const End& from, const Similarity& motion, const End& to,
             LoopObjects& result) {
  constexpr int kShots = 3;  // images: detectors miss an object in single ones
  for (const ObjectId id : from.objects) {
    if (to.objects.contains(id)) continue;
    Object moved = map.objects.At(id);
    MoveObject(motion, moved);
    int shown = 0, missing = 0;
    for (const auto& [frame, shot] : to.shots) {
      const Showing showing = Judge(map, shot, LabelsOf(moved), moved.ellipsoid);
      shown += showing == Showing::kObject;
      missing += showing == Showing::kNoObject;
    }
    result.agreeing += shown >= kShots;
    result.contradicting += shown == 0 && missing >= kShots;
  }
}

}  // namespace

LoopObjects CompareObjects(const Map& map, const LoopClosure& loop) {
  const End here = LookAround(map, loop.current), there = LookAround(map, loop.old);
  LoopObjects result;
  Compare(map, here, loop.old_from_current, there, result);
  Compare(map, there, loop.old_from_current.Inverse(), here, result);
  return result;
}

bool AreObjectsAgainst(const LoopObjects& objects) {
  // Fewer may be missed by the detector, or have been carried away. One object that agrees
  // outweighs two that contradict, since a wrong veto loses a right loop.
  constexpr int kLeastContradicting = 3, kOutweighed = 2;
  return objects.contradicting >= kLeastContradicting &&
         objects.contradicting > kOutweighed * objects.agreeing;
}

}  // namespace oaslam
