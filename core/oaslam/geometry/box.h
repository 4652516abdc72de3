#pragma once

#include <Eigen/Core>

#include "oaslam/types.h"

namespace oaslam {

Box Intersection(const Box& a, const Box& b);  // empty (Area() is 0) where they do not overlap

// Intersection over union; 0 where both are empty.
double IoU(const Box& a, const Box& b);

// The share of the box that lies within `bounds`; 0 for an empty box.
double ShareInside(const Box& box, const Box& bounds);

// The part of a predicted box that a detection with truncated edges (bits of EdgeBit) can show,
// since nothing is visible beyond a truncated edge.
Box ClipAtTruncation(const Box& predicted, const Box& detected, unsigned char truncated);

// Boxes are areas: the pixel coordinate of a box's edge or centre is half a pixel less than its box
// coordinate (docs/conventions.md).
constexpr double kBoxFromPixel = 0.5;

inline Eigen::Vector2d CenterPixel(const Box& box) {
  return box.Center() - Eigen::Vector2d(kBoxFromPixel, kBoxFromPixel);
}

inline Eigen::Vector4d Edges(const Box& box) { return {box.x1, box.y1, box.x2, box.y2}; }

// The geometric mean of width and height.
double SizeOf(const Box& box);

}  // namespace oaslam
