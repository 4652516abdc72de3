#include "oaslam/viewer/viewer_command.h"

#include <map>
#include <nlohmann/json.hpp>

namespace oaslam {
namespace {

using nlohmann::json;
using Kind = ViewerCommand::Kind;

template <typename T>
bool IsA(const json& value) {
  if constexpr (std::is_same_v<T, std::string>) return value.is_string();
  if constexpr (std::is_same_v<T, bool>) return value.is_boolean();
  if constexpr (std::is_same_v<T, double>) return value.is_number();
  if constexpr (std::is_same_v<T, uint32_t>)
    return value.is_number_unsigned() && value.get<uint64_t>() < UINT32_MAX;
}

// Reads an optional value of a message; sets `is_ours` to false where it has the wrong type.
template <typename T>
std::optional<T> Take(const json& message, const char* key, bool& is_ours) {
  const auto found = message.find(key);
  if (found == message.end()) return std::nullopt;
  if (IsA<T>(*found)) return found->get<T>();
  is_ours = false;
  return std::nullopt;
}

std::optional<Eigen::Vector3d> TakeVector(const json& message, const char* key) {
  const auto found = message.find(key);
  if (found == message.end() || !found->is_array() || found->size() != 3) return std::nullopt;
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    if (!(*found)[i].is_number()) return std::nullopt;
    v[i] = (*found)[i].get<double>();
  }
  return v;
}

std::optional<ViewerCommand> ParseRunCommand(const json& message) {
  static const std::map<std::string, Kind> kinds{{"pause", Kind::kPause},
                                                 {"step", Kind::kStep},
                                                 {"reset", Kind::kReset},
                                                 {"relocalize", Kind::kRelocalize},
                                                 {"mapping", Kind::kMapping}};
  bool is_ours = true;
  const auto name = Take<std::string>(message, "name", is_ours);
  const auto on = Take<bool>(message, "on", is_ours);
  const auto kind = kinds.find(name.value_or(""));
  if (!is_ours || kind == kinds.end()) return std::nullopt;
  ViewerCommand command;
  command.kind = kind->second;
  command.on = on.value_or(false);
  return command;
}

std::optional<ViewerCommand> ParsePlacing(const json& message) {
  bool is_ours = true;
  const auto model = Take<std::string>(message, "model", is_ours);
  const auto origin = TakeVector(message, "origin"), direction = TakeVector(message, "direction");
  ViewerCommand command;
  command.kind = Kind::kPlaceAnchor;
  if (const auto object = Take<uint32_t>(message, "object", is_ours))
    command.place.object = ObjectId(*object);
  if (!is_ours || !model || model->empty() || !origin || !direction) return std::nullopt;
  command.place.model = *model;
  command.place.origin = *origin;
  command.place.direction = *direction;
  return command;
}

std::optional<ViewerCommand> ParseAnchorEdit(const json& message) {
  bool is_ours = true;
  ViewerCommand command;
  command.kind = Take<bool>(message, "remove", is_ours).value_or(false) ? Kind::kRemoveAnchor
                                                                        : Kind::kEditAnchor;
  const auto name = Take<std::string>(message, "name", is_ours);
  command.edit.name = Take<std::string>(message, "rename", is_ours);
  command.edit.size = Take<double>(message, "size", is_ours);
  command.edit.turn_rad = Take<double>(message, "turn", is_ours).value_or(0);
  if (!is_ours || !name) return std::nullopt;
  command.anchor = *name;
  return command;
}

}  // namespace

std::optional<ViewerCommand> ParseCommand(const json& message) {
  const std::string type = message.value("type", "");
  if (type == "command") return ParseRunCommand(message);
  if (type == "place") return ParsePlacing(message);
  if (type == "anchor") return ParseAnchorEdit(message);
  return std::nullopt;
}

}  // namespace oaslam
