#include "oaslam/geometry/box.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/camera_model.h"

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

Box ClipAtTruncation(const Box& predicted, const Box& detected, unsigned char truncated) {
  Box clipped = predicted;
  if (truncated & kLeft) clipped.x1 = std::max(clipped.x1, detected.x1);
  if (truncated & kTop) clipped.y1 = std::max(clipped.y1, detected.y1);
  if (truncated & kRight) clipped.x2 = std::min(clipped.x2, detected.x2);
  if (truncated & kBottom) clipped.y2 = std::min(clipped.y2, detected.y2);
  return clipped;
}

double SizeOf(const Box& box) { return std::sqrt(box.Area()); }

}  // namespace oaslam
