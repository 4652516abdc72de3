#pragma once

#include <map>
#include <set>

namespace oaslam {

// Relations of the detector's classes that a user has stated.
struct ClassRelations {
  // From the category of a part to that of the whole it belongs to; without cycles.
  std::map<int, int> whole_of;
  std::set<int> movable;  // neither they nor key points in their boxes are mapped

  // Whether nothing is stated.
  bool Empty() const { return whole_of.empty() && movable.empty(); }

  // Directly or through others.
  bool IsPartOf(int part, int whole) const {
    for (auto next = whole_of.find(part); next != whole_of.end();
         next = whole_of.find(next->second))
      if (next->second == whole) return true;
    return false;
  }

  // A part of a movable class is movable, too.
  bool IsMovable(int category) const {
    auto whole = whole_of.find(category);
    for (; whole != whole_of.end() && !movable.contains(category); whole = whole_of.find(category))
      category = whole->second;
    return movable.contains(category);
  }

  bool operator==(const ClassRelations&) const = default;
};

}  // namespace oaslam
