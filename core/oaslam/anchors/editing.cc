#include "oaslam/anchors/editing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/anchors/placement.h"

namespace oaslam {
namespace {

constexpr size_t kMaxName = 64;      // bytes; a label on the screen
constexpr size_t kMaxAnchors = 200;  // all are sent to every viewer when one has moved

bool IsName(const std::string& name) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  return !name.empty() && name.size() <= kMaxName && std::ranges::none_of(name, is_control);
}

std::string ProblemOfName(const std::string& name, const Anchors& anchors) {
  if (!IsName(name) || name.find('=') != std::string::npos)
    return fmt::format(
        "the name of an anchor has 1 to {} bytes, none of them a control character or \"=\"",
        kMaxName);
  if (anchors.contains(name)) return fmt::format("there is an anchor \"{}\" already", name);
  return "";
}

std::string ProblemOfModel() {
  return fmt::format("the name of a model has 1 to {} bytes, none of them a control character",
                     kMaxName);
}

std::string ProblemOfAbsence(const std::string& name) {
  return fmt::format("there is no anchor \"{}\"", name);
}

std::string FreeName(const std::string& model, const Anchors& anchors) {
  for (int number = 1;; ++number)
    if (std::string name = fmt::format("{} {}", model, number); !anchors.contains(name))
      return name;
}

}  // namespace

AnchorReport PlaceAnchor(const Map& map, const AnchorRequest& request, Anchors& anchors) {
  if (anchors.size() >= kMaxAnchors)
    return {"", fmt::format("a map holds at most {} anchors", kMaxAnchors)};
  if (!IsName(request.model)) return {"", ProblemOfModel()};
  const std::string name = request.name.empty() ? FreeName(request.model, anchors) : request.name;
  if (const std::string problem = ProblemOfName(name, anchors); !problem.empty())
    return {"", problem};
  Placement placement = FindPlace(map, request);
  if (!placement.anchor) return {"", placement.why_not};
  anchors.emplace(name, std::move(*placement.anchor));
  return {name, ""};
}

AnchorReport EditAnchor(const Map& map, const std::string& name, const AnchorEdit& edit,
                        Anchors& anchors) {
  const auto found = anchors.find(name);
  if (found == anchors.end()) return {"", ProblemOfAbsence(name)};
  if (edit.size)
    if (const std::string problem = ProblemOfSize(*edit.size); !problem.empty())
      return {"", problem};
  if (edit.model && !IsName(*edit.model)) return {"", ProblemOfModel()};
  const std::optional<Anchor> moved = edit.pose ? AnchorAt(map, *edit.pose) : std::nullopt;
  if (edit.pose && !moved) return {"", kNoPose};
  if (!std::isfinite(edit.turn_rad)) return {"", "the angle is no number"};
  const bool is_renamed = edit.name && *edit.name != name;
  if (is_renamed)
    if (const std::string problem = ProblemOfName(*edit.name, anchors); !problem.empty())
      return {"", problem};
  Anchor& anchor = found->second;
  if (moved) {
    const Anchor before = std::exchange(anchor, *moved);
    anchor.model = before.model;
    anchor.size = before.size;
  }
  if (edit.model) anchor.model = *edit.model;
  if (edit.size) anchor.size = *edit.size;
  Rigid3::Rotation& rotation = anchor.cam_from_anchor.rotation;
  rotation = (rotation * Eigen::AngleAxisd(edit.turn_rad, Eigen::Vector3d::UnitY())).normalized();
  if (!is_renamed) return {name, ""};
  auto node = anchors.extract(found);
  node.key() = *edit.name;
  anchors.insert(std::move(node));
  return {*edit.name, ""};
}

AnchorReport RemoveAnchor(const std::string& name, Anchors& anchors) {
  if (anchors.erase(name) == 0) return {"", ProblemOfAbsence(name)};
  return {name, ""};
}

std::vector<AnchorPose> PosesOf(const Map& map) {
  std::vector<AnchorPose> poses;
  for (const auto& [name, anchor] : map.anchors) {
    const std::optional<Rigid3> pose = WorldFromAnchor(map, anchor);
    if (!pose) continue;
    const std::optional<ObjectId> object =
        anchor.object.IsValid() ? map.ResolveObject(anchor.object) : std::nullopt;
    poses.push_back({name, anchor.model, anchor.size, *pose, object});
  }
  return poses;
}

}  // namespace oaslam
