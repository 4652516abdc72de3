#pragma once

#include <span>

#include "oaslam/types.h"

namespace oaslam {

// Edges of a box (bits as of EdgeBit) that lie behind these nearer boxes for most of their length:
// where the thing itself ends there is not seen. `pixel`: that of the detector (DetectorPixel), in
// px.
unsigned char HiddenEdges(const Box& box, std::span<const Box> nearer, double pixel);

}  // namespace oaslam
