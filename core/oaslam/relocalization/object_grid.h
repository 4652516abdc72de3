#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

namespace oaslam {

// Points in cubic cells, for finding those near a place: the cost does not depend on how many there
// are elsewhere.
class ObjectGrid {
 public:
  // `cell`: the side of a cell, about the distance that will be asked for; positive.
  ObjectGrid(std::vector<Eigen::Vector3d> points, double cell);

  // Fills `near` with the indices of the points within a distance of a place, in the order of the
  // grid's cells.
  void FindNear(const Eigen::Vector3d& place, double distance, std::vector<int>& near) const;

 private:
  using Key = std::uint64_t;
  Eigen::Array3<std::int64_t> CellOf(const Eigen::Vector3d& point) const;
  static Key KeyOf(const Eigen::Array3<std::int64_t>& cell);

  std::vector<Eigen::Vector3d> points_;
  double cell_;
  std::vector<std::pair<Key, int>> entries_;  // ascending
};

}  // namespace oaslam
