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
};

// Moves the nodes (cam_from_world, each with a scale of its own) so that the edges hold as well as
// they can together, which spreads the drift around a loop over its cameras (Strasdat, Montiel and
// Davison 2010). Nodes marked in `fixed` stay. `depth`: about how far the scene is, in the unit of
// the nodes: errors of position count relative to it. Nothing if the solver fails.
std::optional<std::vector<Similarity>> OptimizePoseGraph(const std::vector<Similarity>& nodes,
                                                         const std::vector<PoseGraphEdge>& edges,
                                                         const std::vector<char>& fixed,
                                                         double depth);

}  // namespace oaslam
