#pragma once

#include <map>
#include <set>

namespace oaslam {

// What a user says of the detector's classes, beyond their names.
struct ClassRelations {
  std::map<int, int>
      whole_of;           // of a part's category, that of what it is a part of; without cycles
  std::set<int> movable;  // never mapped, nor the key points in their boxes

  bool Empty() const { return whole_of.empty() && movable.empty(); }

  bool IsPartOf(int part, int whole) const {
    for (auto next = whole_of.find(part); next != whole_of.end();
         next = whole_of.find(next->second))
      if (next->second == whole) return true;
    return false;
  }

  // A part of what moves moves, too.
  bool IsMovable(int category) const {
    auto whole = whole_of.find(category);
    for (; whole != whole_of.end() && !movable.contains(category); whole = whole_of.find(category))
      category = whole->second;
    return movable.contains(category);
  }

  bool operator==(const ClassRelations&) const = default;
};

}  // namespace oaslam
