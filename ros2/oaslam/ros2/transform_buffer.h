#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/recordings/ros_messages.h"

namespace oaslam {

// The frames of a robot, a tree: of /tf with its last ten seconds, and of /tf_static.
class TransformBuffer {
 public:
  void Add(const RosTransform& transform, bool is_static);
  // target_from_source at this time, nanoseconds. Nothing where the frames are not connected, or
  // where /tf does not tell this time: between two of its times it is interpolated, outside never
  // guessed.
  std::optional<Rigid3> Find(const std::string& target, const std::string& source,
                             int64_t stamp) const;
  // Whether they are connected, at whatever time.
  bool Connects(const std::string& target, const std::string& source) const;
  bool HasParent(const std::string& frame) const { return edges_.contains(frame); }
  // Forgets /tf, as where its clock begins anew.
  void ForgetMoving();

 private:
  struct Edge {  // of a frame to its parent
    std::string parent;
    bool is_static = false;
    std::map<int64_t, Rigid3> parent_from_child{};  // by time; of a static one a single one
    std::optional<Rigid3> At(int64_t stamp) const;
  };
  // A frame and those above it, the nearest first.
  std::vector<std::string> Ancestors(const std::string& frame) const;
  // The nearest frame above both; nothing: they are not connected.
  std::optional<std::string> Common(const std::string& a, const std::string& b) const;
  std::optional<Rigid3> Up(const std::string& frame, const std::string& ancestor,
                           int64_t stamp) const;

  std::map<std::string, Edge> edges_;  // by child
};

}  // namespace oaslam
