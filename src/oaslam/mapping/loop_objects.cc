#include "oaslam/mapping/loop_objects.h"

#include <algorithm>
#include <set>
#include <vector>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

constexpr int kGroup = 10;  // keyframes about an end

std::set<KeyframeId> Around(const Map& map, KeyframeId end) {
  const std::vector<KeyframeId> neighbours = map.CovisibleKeyframes(end, kGroup);
  std::set<KeyframeId> group(neighbours.begin(), neighbours.end());
  group.insert(end);
  return group;
}

// The mapped objects with an observation relative to one of the keyframes.
std::set<ObjectId> SeenFrom(const Map& map, const std::set<KeyframeId>& keyframes) {
  std::set<ObjectId> seen;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped || map.classes.IsMovable(object.category_id)) return;
    for (const ObjectObservation& o : object.observations) {
      const auto carried = map.ResolveKeyframe(o.reference);
      if (!carried || !keyframes.contains(carried->by)) continue;
      seen.insert(id);
      return;
    }
  });
  return seen;
}

Ellipsoid Moved(const Ellipsoid& ellipsoid, const Similarity& motion) {
  return {motion * ellipsoid.center, motion.scale * ellipsoid.half_axes,
          (motion.rotation * ellipsoid.rotation).normalized()};
}

bool AreSamePlace(const Ellipsoid& a, const Ellipsoid& b) {
  constexpr double kSizes = 2;  // ellipsoids of few views are off by as much
  return (a.center - b.center).norm() < kSizes * (a.half_axes.maxCoeff() + b.half_axes.maxCoeff());
}

// Whether the keyframe would show the object large, well inside its image and with nothing nearer
// in front.
bool WouldShow(const Map& map, const Keyframe& keyframe, const Ellipsoid& ellipsoid,
               const std::set<ObjectId>& about) {
  constexpr double kLeastSize = 40;  // detector pixels
  constexpr double kInside = 0.95;
  const Camera& camera = map.cameras[keyframe.camera];
  const auto box = ProjectToBox(ellipsoid, keyframe.cam_from_world, camera);
  if (!box || SizeOf(*box) < kLeastSize * DetectorPixel(camera) ||
      ShareInside(*box, keyframe.features->bounds) < kInside)
    return false;
  const double depth = (keyframe.cam_from_world * ellipsoid.center).z();
  // Landmarks in front of it, as of a wall: it would be hidden.
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
  if (2 * nearer > all) return false;
  return std::ranges::none_of(about, [&](ObjectId id) {
    const Ellipsoid& other = map.objects.At(id).ellipsoid;
    const auto other_box = ProjectToBox(other, keyframe.cam_from_world, camera);
    return other_box && (keyframe.cam_from_world * other.center).z() < depth &&
           ShareInside(*box, *other_box) > 0.2;
  });
}

// Adds what the objects of one end say, taken to the other end by `motion`.
void Compare(const Map& map, const std::set<ObjectId>& objects, const Similarity& motion,
             const std::set<ObjectId>& others, const std::set<KeyframeId>& keyframes,
             LoopObjects& result) {
  constexpr int kViews = 3;
  for (const ObjectId id : objects) {
    if (others.contains(id)) continue;
    const Object& object = map.objects.At(id);
    const Ellipsoid moved = Moved(object.ellipsoid, motion);
    const bool is_there = std::ranges::any_of(others, [&](ObjectId other) {
      const Object& candidate = map.objects.At(other);
      return candidate.category_id == object.category_id &&
             AreSamePlace(moved, candidate.ellipsoid);
    });
    if (is_there) {
      ++result.agreeing;
      continue;
    }
    const auto views = std::ranges::count_if(keyframes, [&](KeyframeId k) {
      return WouldShow(map, map.keyframes.At(k), moved, others);
    });
    result.contradicting += views >= kViews;
  }
}

}  // namespace

LoopObjects CompareObjects(const Map& map, const LoopClosure& loop) {
  const std::set<KeyframeId> here = Around(map, loop.current), there = Around(map, loop.old);
  const std::set<ObjectId> seen_here = SeenFrom(map, here), seen_there = SeenFrom(map, there);
  LoopObjects result;
  Compare(map, seen_here, loop.old_from_current, seen_there, there, result);
  Compare(map, seen_there, loop.old_from_current.Inverse(), seen_here, here, result);
  return result;
}

bool AreObjectsAgainst(const LoopObjects& objects) {
  return objects.contradicting >= 3 && objects.contradicting > 2 * objects.agreeing;
}

}  // namespace oaslam
