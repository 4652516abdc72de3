#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>

#include "oaslam/map/map.h"

namespace oaslam {

// The uncertainty of a keyframe's position along a chain of keyframes.
struct ChainOfViews {
  // The variance of the position; a link between keyframes that share no landmark adds 1.
  double links = 0;
  // The variance of the logarithm of the scale: the sum over the links. `scale_at` and
  // `scale_at_squared` are the same sum with each link multiplied by the position where it begins,
  // and by the square of that position. The scale error of a link moves a position in proportion to
  // its distance from there.
  double scale = 0;
  Eigen::Vector3d scale_at = Eigen::Vector3d::Zero();
  double scale_at_squared = 0;

  void Add(double link, double scale_variance, const Eigen::Vector3d& at);
  // Multiplies the lengths kept here by `factor`, after those of the map were.
  void Scale(double factor);
  // The expected squared error of a position due to the scale errors of the links, map units^2.
  double SquaredOffByScale(const Eigen::Vector3d& position) const;
};

// Estimates the drift between the parts of a map. Two keyframes that share all landmarks know their
// relative pose. Each new keyframe is located by the landmarks that it shares with earlier
// keyframes, and its error is added to theirs. So errors grow along the shortest chain of
// keyframes, and a loop, which shortens the chains, reduces them. Chains begin in the middle of the
// map, at the keyframe with the median variance of the scale, so that a bad beginning of a map does
// not make all later keyframes uncertain.
class MapDrift {
 public:
  // The chain to a keyframe. Computes all chains again after a loop, and when the map has half as
  // many keyframes again; does not follow smaller corrections of the map in between.
  const ChainOfViews& ChainTo(const Map& map, KeyframeId id);
  // Multiplies the lengths kept here by `factor`, after those of the map were.
  void Scale(double factor);

 private:
  void LinkAll(const Map& map);

  std::map<KeyframeId, ChainOfViews> chains_;
  size_t linked_ = 0;  // number of keyframes when all chains were last computed
  int loops_closed_ = 0;
};

}  // namespace oaslam
