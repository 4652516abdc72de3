#include "oaslam/estimation/hidden_edges.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// Share of an edge that must be hidden. Less: an edge whose visible part tells its place is lost;
// more: a detector closes its box at the hiding object, and the edge pulls the ellipsoid there.
constexpr double kMostOfIt = 0.7;
// A hiding box must reach beyond the edge by this share of the hidden box and these detector pixels
// (the precision of boxes), since where one object hides another their outlines touch.
constexpr double kMargin = 0.1, kMarginPixels = 3;

// Collects the hidden parts of an edge from `begin` to `end`.
class Cover {
 public:
  Cover(double begin, double end) : begin_(begin), end_(end) {}
  void Add(double from, double to) {
    from = std::max(from, begin_);
    to = std::min(to, end_);
    if (from < to) parts_.emplace_back(from, to);
  }
  bool IsMostOfIt() {
    std::ranges::sort(parts_);
    double covered = 0, reached = begin_;
    for (const auto& [from, to] : parts_) {
      covered += std::max(0.0, to - std::max(from, reached));
      reached = std::max(reached, to);
    }
    return covered > kMostOfIt * (end_ - begin_);
  }

 private:
  double begin_, end_;
  std::vector<std::pair<double, double>> parts_;
};

}  // namespace

unsigned char HiddenEdges(const Box& box, std::span<const Box> nearer, double pixel) {
  const double mx = kMarginPixels * pixel + kMargin * box.Width(),
               my = kMarginPixels * pixel + kMargin * box.Height();
  Cover left(box.y1, box.y2), right = left, top(box.x1, box.x2), bottom = top;
  for (const Box& by : nearer) {
    // Only a box that reaches beyond the edge hides it; otherwise the edge is visible beside it.
    if (by.x1 < box.x1 - mx && by.x2 > box.x1 - mx) left.Add(by.y1, by.y2);
    if (by.x2 > box.x2 + mx && by.x1 < box.x2 + mx) right.Add(by.y1, by.y2);
    if (by.y1 < box.y1 - my && by.y2 > box.y1 - my) top.Add(by.x1, by.x2);
    if (by.y2 > box.y2 + my && by.y1 < box.y2 + my) bottom.Add(by.x1, by.x2);
  }
  unsigned char hidden = 0;
  if (left.IsMostOfIt()) hidden |= kLeft;
  if (top.IsMostOfIt()) hidden |= kTop;
  if (right.IsMostOfIt()) hidden |= kRight;
  if (bottom.IsMostOfIt()) hidden |= kBottom;
  return hidden;
}

}  // namespace oaslam
