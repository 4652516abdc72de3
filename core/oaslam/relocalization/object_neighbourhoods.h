#pragma once

#include <limits>
#include <span>
#include <vector>

#include "oaslam/relocalization/object_grid.h"
#include "oaslam/relocalization/object_scene.h"

namespace oaslam {

// The depth estimated from the size of a truncated box is right within this factor. It is larger
// than for whole boxes, since the object may be much nearer.
constexpr double kTruncatedFactor = 3;

// A hypothesis that a detection shows an object, with the depth that its size suggests.
struct Node {
  int detection = 0, object = 0;
  double depth = 0, min_depth = 0, max_depth = 0;
};

// Whether both can be true, i.e. some depths within the bounds of both put the objects at their
// distance in the map.
bool AreCompatible(const ObjectScene& scene, const Node& a, const Node& b);

// A node that hypotheses start from, and the nodes that are compatible with it.
struct Start {
  Node origin;
  std::span<const int> done;  // detections that earlier starts came from
  std::vector<Node> neighbours{};
  int support = 0;       // number of distinct detections among the neighbours
  double agreement = 0;  // sum over these detections
};

// Finds the starts of hypotheses, and the objects around them.
class Neighbourhoods {
 public:
  // `scene` must outlive it.
  explicit Neighbourhoods(const ObjectScene& scene);

  bool IsLargeMap() const;
  // The objects that a pose from this node is scored by.
  std::vector<int> ScopeOf(const Node& origin) const;
  // In a large map returns only the starts with which most other detections are compatible, and of
  // these those that agree best: any other start is probably of another object.
  std::vector<Start> FindStarts() const;

 private:
  struct Depths {
    double min = std::numeric_limits<double>::max(), max = 0;
  };

  static std::vector<Depths> DepthsOf(const ObjectScene& scene);
  static double UsualReach(const std::vector<Depths>& depths);
  double ReachOf(const Node& origin) const;
  template <typename Visitor>
  void VisitCompatible(const Start& start, std::vector<int>& near, Visitor&& visit) const;
  double SquaredRatio(const Node& a, const Node& b) const;
  void KeepBest(std::vector<Start>& starts) const;

  const ObjectScene& scene_;
  std::vector<int> detections_;
  std::vector<Depths> depths_;  // by detection
  ObjectGrid grid_;
};

}  // namespace oaslam
