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
  double held = 1;   // how well the way and the scale are known, in 1 / sigma
  double depth = 1;  // typical of the scene there, relative to which errors of the way count
  // Where it is not, only the rotation and the centre of `to` relative to `from` count.
  bool is_scale_known = true;
};

// Optimises the nodes (cam_from_world, each with its own scale) so that the edges are satisfied as
// well as possible together, which distributes the drift around a loop over its cameras (Strasdat,
// Montiel and Davison 2010), most of it where edges hold least. Nodes marked in `fixed` do not
// move. Returns nothing if the solver fails.
std::optional<std::vector<Similarity>> OptimizePoseGraph(const std::vector<Similarity>& nodes,
                                                         const std::vector<PoseGraphEdge>& edges,
                                                         const std::vector<char>& fixed);

}  // namespace oaslam
