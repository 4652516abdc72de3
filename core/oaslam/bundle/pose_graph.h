#pragma once

#include <optional>
#include <vector>

#include "oaslam/geometry/similarity.h"

namespace oaslam {

// Two cameras whose relative motion is known: to_from_from = cam_to_from_world *
// cam_from_from_world^-1.
struct PoseGraphEdge {
  int from = 0, to = 0;  // indices of nodes
  Similarity to_from_from;
  double held = 1;  // 1 / sigma of the translation and of the scale
  // Typical depth of the scene at this edge: errors of the translation are relative to this depth.
  double depth = 1;
  // If it is false, only the rotation and the centre of `to` relative to `from` count.
  bool is_scale_known = true;
};

// Optimises the nodes (cam_from_world, each with its own scale) so that the edges are satisfied as
// well as possible together, which distributes the drift around a loop over its cameras (Strasdat,
// Montiel and Davison 2010), most of it over the edges with the smallest `held`. Nodes marked in
// `fixed` do not move. Returns nothing if the solver fails.
std::optional<std::vector<Similarity>> OptimizePoseGraph(const std::vector<Similarity>& nodes,
                                                         const std::vector<PoseGraphEdge>& edges,
                                                         const std::vector<char>& fixed);

}  // namespace oaslam
