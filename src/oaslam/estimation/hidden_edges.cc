#include "oaslam/estimation/hidden_edges.h"

#include <algorithm>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

constexpr double kMostOfIt = 0.7;      // share of an edge
constexpr double kMargin = 0.1;        // of the box, beside 3 px: an outline ends where that of what hides it begins
constexpr double kMarginPx = 3;

double Overlap(double a1, double a2, double b1, double b2) { return std::max(0.0, std::min(a2, b2) - std::max(a1, b1)); }

}  // namespace

unsigned char HiddenEdges(const Box& box, std::span<const Box> nearer) {
  const double width = box.Width(), height = box.Height();
  const double mx = kMarginPx + kMargin * width, my = kMarginPx + kMargin * height;
  double left = 0, top = 0, right = 0, bottom = 0;  // covered lengths
  for (const Box& by : nearer) {
    const double along_x = Overlap(by.x1, by.x2, box.x1, box.x2), along_y = Overlap(by.y1, by.y2, box.y1, box.y2);
    // It reaches beyond the edge: else it stands before the object, and hides no end of it.
    if (by.x1 < box.x1 - mx && by.x2 > box.x1 - mx) left += along_y;
    if (by.x2 > box.x2 + mx && by.x1 < box.x2 + mx) right += along_y;
    if (by.y1 < box.y1 - my && by.y2 > box.y1 - my) top += along_x;
    if (by.y2 > box.y2 + my && by.y1 < box.y2 + my) bottom += along_x;
  }
  unsigned char hidden = 0;
  if (left > kMostOfIt * height) hidden |= kLeft;
  if (top > kMostOfIt * width) hidden |= kTop;
  if (right > kMostOfIt * height) hidden |= kRight;
  if (bottom > kMostOfIt * width) hidden |= kBottom;
  return hidden;
}

}  // namespace oaslam
