#include "oaslam/relocalization/object_grid.h"

#include <algorithm>
#include <cmath>

namespace oaslam {

ObjectGrid::ObjectGrid(std::vector<Eigen::Vector3d> points, double cell)
    : points_(std::move(points)), cell_(cell) {
  for (int i = 0; i < static_cast<int>(points_.size()); ++i)
    entries_.emplace_back(KeyOf(CellOf(points_[i])), i);
  std::ranges::sort(entries_);
}

Eigen::Array3<std::int64_t> ObjectGrid::CellOf(const Eigen::Vector3d& point) const {
  return (point / cell_).array().floor().cast<std::int64_t>();
}

// Cells that differ in z only have keys in a row. Cells of one key, which are a million cells
// apart, are told apart by the distance.
ObjectGrid::Key ObjectGrid::KeyOf(const Eigen::Array3<std::int64_t>& cell) {
  constexpr int kBits = 21;  // three of them fit into a key of 64 bits
  constexpr Key kMask = (Key{1} << kBits) - 1, kMiddle = Key{1} << (kBits - 1);
  Key key = 0;
  for (const std::int64_t c : cell) key = key << kBits | ((static_cast<Key>(c) + kMiddle) & kMask);
  return key;
}

void ObjectGrid::FindNear(const Eigen::Vector3d& place, double distance,
                          std::vector<int>& near) const {
  near.clear();
  const auto add = [&](int i) {
    if ((points_[i] - place).norm() < distance) near.push_back(i);
  };
  const Eigen::Array3<std::int64_t> low = CellOf(place.array() - distance),
                                    high = CellOf(place.array() + distance);
  const double columns = (high - low + 1).head<2>().cast<double>().prod();
  if (columns > static_cast<double>(entries_.size())) {
    for (const auto& [key, i] : entries_) add(i);
  } else {
    for (std::int64_t x = low.x(); x <= high.x(); ++x)
      for (std::int64_t y = low.y(); y <= high.y(); ++y) {
        const Key last = KeyOf({x, y, high.z()});
        for (auto entry = std::ranges::lower_bound(entries_, std::pair(KeyOf({x, y, low.z()}), 0));
             entry != entries_.end() && entry->first <= last; ++entry)
          add(entry->second);
      }
  }
}

}  // namespace oaslam
