#pragma once

#include <map>
#include <set>

namespace oaslam {

// Relations of the detector's classes that a user has stated:
//
//   constexpr int kPerson = 0, kKeyboard = 66, kKey = 80;
//   slam.SetClassRelations({.whole_of = {{kKey, kKeyboard}}, .movable = {kPerson}});
struct ClassRelations {
  // From the category of a part to that of the whole it belongs to; without cycles.
  std::map<int, int> whole_of;
  std::set<int> movable;  // objects of these classes and key points in their boxes are not mapped

  // Whether a user has stated no relation.
  bool Empty() const { return whole_of.empty() && movable.empty(); }

  // Whether the class `part` belongs to the class `whole`, directly or through other parts.
  bool IsPartOf(int part, int whole) const {
    for (auto next = whole_of.find(part); next != whole_of.end();
         next = whole_of.find(next->second))
      if (next->second == whole) return true;
    return false;
  }

  // Whether the class, or a whole it is part of, is movable.
  bool IsMovable(int category) const {
    auto whole = whole_of.find(category);
    for (; whole != whole_of.end() && !movable.contains(category); whole = whole_of.find(category))
      category = whole->second;
    return movable.contains(category);
  }

  bool operator==(const ClassRelations&) const = default;
};

}  // namespace oaslam
