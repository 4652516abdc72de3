#include "oaslam/map/parts.h"

#include "oaslam/geometry/ellipsoid.h"

namespace oaslam {
namespace {

// The whole's ellipsoid is enlarged by this factor, since a part may lie in a corner of the box
// around it, outside of the ellipsoid: by a factor of sqrt(3) = 1.73 at most, but the part has its
// centre inside of the corner.
constexpr double kReach = 1.5;

bool LiesIn(const Ellipsoid& part, Ellipsoid whole) {
  whole.half_axes *= kReach;
  return Contains(whole, part.center);
}

}  // namespace

bool BelongTogether(const ClassRelations& classes, int category_a, const Ellipsoid& a,
                    int category_b, const Ellipsoid& b) {
  if (classes.whole_of.empty()) return false;
  return (classes.IsPartOf(category_a, category_b) && LiesIn(a, b)) ||
         (classes.IsPartOf(category_b, category_a) && LiesIn(b, a));
}

std::optional<ObjectId> WholeOf(const Map& map, ObjectId part) {
  if (map.classes.whole_of.empty()) return std::nullopt;
  const Object& own = map.objects.At(part);
  std::optional<ObjectId> whole;
  double smallest = 0;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped ||
        !map.classes.IsPartOf(own.category_id, object.category_id) ||
        !LiesIn(own.ellipsoid, object.ellipsoid))
      return;
    const double volume = object.ellipsoid.half_axes.prod();
    if (whole && volume >= smallest) return;
    whole = id;
    smallest = volume;
  });
  return whole;
}

}  // namespace oaslam
