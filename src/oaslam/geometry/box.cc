#include "oaslam/geometry/box.h"

#include <algorithm>
#include <cmath>

namespace oaslam {

Box Intersection(const Box& a, const Box& b) {
  return {std::max(a.x1, b.x1), std::max(a.y1, b.y1), std::min(a.x2, b.x2), std::min(a.y2, b.y2)};
}

double IoU(const Box& a, const Box& b) {
  const double shared = Intersection(a, b).Area(), joint = a.Area() + b.Area() - shared;
  return joint > 0 ? shared / joint : 0;
}

double ShareInside(const Box& box, const Box& bounds) {
  const double area = box.Area();
  return area > 0 ? Intersection(box, bounds).Area() / area : 0;
}

double SizeOf(const Box& box) { return std::sqrt(box.Area()); }

}  // namespace oaslam
