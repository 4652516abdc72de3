#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>

#include "oaslam/map/map.h"

namespace oaslam {

// How well a keyframe's place is known by a chain of views.
struct ChainOfViews {
  // The variance of its place, where a link between views that share nothing counts 1.
  double links = 0;
  // Of the scale's logarithm: the sum of the variances that links add; the same times where they
  // begin, and times the square of that. What a link loses of the scale moves a place by as much
  // as it is away from there.
  double scale = 0;
  Eigen::Vector3d scale_at = Eigen::Vector3d::Zero();
  double scale_at_squared = 0;

  void Add(double link, double scale_variance, const Eigen::Vector3d& at);
  // Where all lengths of the map are multiplied.
  void Scale(double factor);
  // The expected square of how far a position is off by what the scale has lost; map units.
  double SquaredOffByScale(const Eigen::Vector3d& position) const;
};

// How far a map may be bent between its parts. Views that share all landmarks know each other's
// place; each new view is known by what it shares with those before, and its error is added to
// theirs. So errors grow along the shortest chain of views, and a loop, which makes chains shorter,
// takes them back. Chains begin in the middle of the map, at the median keyframe by how far the
// scale has wandered up to it, so that a map that began badly does not doubt all that follows.
class MapDrift {
 public:
  // Looks at all keyframes after a loop, and when there are half as many again. Smaller corrections
  // of the map in between are not followed.
  const ChainOfViews& ChainTo(const Map& map, KeyframeId id);
  // Follows a map of which all lengths were multiplied by `factor`.
  void Scale(double factor);

 private:
  void LinkAll(const Map& map);

  std::map<KeyframeId, ChainOfViews> chains_;
  size_t linked_ = 0;  // keyframes, when all were looked at last
  int loops_closed_ = 0;
};

}  // namespace oaslam
