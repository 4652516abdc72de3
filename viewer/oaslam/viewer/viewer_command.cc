#include "oaslam/viewer/viewer_command.h"

#include <map>

#include "oaslam/error.h"
#include "oaslam/net/json_input.h"

namespace oaslam {
namespace {

using Kind = ViewerCommand::Kind;

std::optional<ViewerCommand> ParseRunCommand(const JsonInput& message) {
  static const std::map<std::string, Kind> kinds{{"pause", Kind::kPause},
                                                 {"step", Kind::kStep},
                                                 {"reset", Kind::kReset},
                                                 {"relocalize", Kind::kRelocalize},
                                                 {"mapping", Kind::kMapping}};
  const auto kind = kinds.find(message["name"].Text());
  if (kind == kinds.end()) return std::nullopt;
  ViewerCommand command;
  command.kind = kind->second;
  if (const auto on = message.Find("on")) command.on = on->Boolean();
  return command;
}

std::optional<ViewerCommand> ParsePlacing(const JsonInput& message) {
  ViewerCommand command;
  command.kind = Kind::kPlaceAnchor;
  command.place.model = message["model"].Text();
  command.place.origin = message["origin"].Vector();
  command.place.direction = message["direction"].Vector();
  if (const auto object = message.Find("object"))
    command.place.object = ObjectId(static_cast<uint32_t>(object->Integer(0, INT32_MAX)));
  if (command.place.model.empty()) return std::nullopt;
  return command;
}

ViewerCommand ParseAnchorEdit(const JsonInput& message) {
  ViewerCommand command;
  const auto remove = message.Find("remove");
  command.kind = remove && remove->Boolean() ? Kind::kRemoveAnchor : Kind::kEditAnchor;
  command.anchor = message["name"].Text();
  if (const auto rename = message.Find("rename")) command.edit.name = rename->Text();
  if (const auto size = message.Find("size")) command.edit.size = size->Number();
  if (const auto turn = message.Find("turn")) command.edit.turn_rad = turn->Number();
  return command;
}

}  // namespace

std::optional<ViewerCommand> ParseCommand(const nlohmann::json& json) {
  try {
    const JsonInput message(json, "message");
    const std::string& type = message["type"].Text();
    if (type == "command") return ParseRunCommand(message);
    if (type == "place") return ParsePlacing(message);
    if (type == "anchor") return ParseAnchorEdit(message);
  } catch (const InputError&) {
    // It is not one of the page's.
  }
  return std::nullopt;
}

}  // namespace oaslam
