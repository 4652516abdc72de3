#include "oaslam/ros2/transform_buffer.h"

#include <algorithm>

namespace oaslam {
namespace {

// Between a and b, as far as `share`.
Rigid3 Between(const Rigid3& a, const Rigid3& b, double share) {
  return {a.rotation.slerp(share, b.rotation), (1 - share) * a.translation + share * b.translation};
}

}  // namespace

std::optional<Rigid3> TransformBuffer::Edge::At(int64_t stamp) const {
  if (is_static) return parent_from_child.begin()->second;
  const auto after = parent_from_child.lower_bound(stamp);
  if (after == parent_from_child.end()) return std::nullopt;
  if (after->first == stamp) return after->second;
  if (after == parent_from_child.begin()) return std::nullopt;
  const auto before = std::prev(after);
  return Between(before->second, after->second,
                 static_cast<double>(stamp - before->first) /
                     static_cast<double>(after->first - before->first));
}

void TransformBuffer::Add(const RosTransform& transform, bool is_static) {
  constexpr int64_t kKept = 10'000'000'000;                 // nanoseconds
  constexpr size_t kMostFrames = 1000, kMostKept = 10'000;  // bound the memory
  if (edges_.size() >= kMostFrames && !edges_.contains(transform.child)) return;
  Edge& edge = edges_[transform.child];
  if (edge.parent != transform.parent || is_static || edge.is_static)
    edge.parent_from_child.clear();
  // Its clock was set back, or what came last was wrong.
  if (!edge.parent_from_child.empty() &&
      transform.stamp < edge.parent_from_child.rbegin()->first - kKept)
    edge.parent_from_child.clear();
  edge.parent = transform.parent;
  edge.is_static = is_static;
  edge.parent_from_child[transform.stamp] = transform.parent_from_child;
  const int64_t newest = edge.parent_from_child.rbegin()->first;
  edge.parent_from_child.erase(edge.parent_from_child.begin(),
                               edge.parent_from_child.lower_bound(newest - kKept));
  if (edge.parent_from_child.size() > kMostKept)
    edge.parent_from_child.erase(edge.parent_from_child.begin());
}

void TransformBuffer::ForgetMoving() {
  std::erase_if(edges_, [](const auto& edge) { return !edge.second.is_static; });
}

std::vector<std::string> TransformBuffer::Ancestors(const std::string& frame) const {
  constexpr size_t kMostAbove = 100;
  std::vector<std::string> found = {frame};
  for (auto edge = edges_.find(frame); edge != edges_.end();
       edge = edges_.find(edge->second.parent)) {
    if (std::ranges::count(found, edge->second.parent) > 0) break;  // a loop is no tree
    if (found.size() > kMostAbove) break;
    found.push_back(edge->second.parent);
  }
  return found;
}

std::optional<std::string> TransformBuffer::Common(const std::string& a,
                                                   const std::string& b) const {
  const std::vector<std::string> above_b = Ancestors(b);
  for (const std::string& frame : Ancestors(a))
    if (std::ranges::count(above_b, frame) > 0) return frame;
  return std::nullopt;
}

bool TransformBuffer::Connects(const std::string& target, const std::string& source) const {
  return Common(target, source).has_value();
}

std::optional<Rigid3> TransformBuffer::Up(const std::string& frame, const std::string& ancestor,
                                          int64_t stamp) const {
  Rigid3 at_from_frame;
  for (std::string at = frame; at != ancestor;) {
    const Edge& edge = edges_.at(at);
    const std::optional<Rigid3> parent_from_at = edge.At(stamp);
    if (!parent_from_at) return std::nullopt;
    at_from_frame = *parent_from_at * at_from_frame;
    at = edge.parent;
  }
  return at_from_frame;
}

std::optional<Rigid3> TransformBuffer::Find(const std::string& target, const std::string& source,
                                            int64_t stamp) const {
  const auto common = Common(target, source);
  if (!common) return std::nullopt;
  const auto common_from_target = Up(target, *common, stamp);
  const auto common_from_source = Up(source, *common, stamp);
  if (!common_from_target || !common_from_source) return std::nullopt;
  return common_from_target->Inverse() * *common_from_source;
}

}  // namespace oaslam
