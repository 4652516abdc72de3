#pragma once

#include <span>

#include "oaslam/types.h"

namespace oaslam {

// The edges of a box (bits of EdgeBit) that are hidden by nearer boxes for most of their length:
// the true extent of the object is not visible there. `pixel`: the size of a detector pixel
// (DetectorPixel), px.
unsigned char HiddenEdges(const Box& box, std::span<const Box> nearer, double pixel);

}  // namespace oaslam
