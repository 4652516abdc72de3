#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "oaslam/anchors.h"

namespace oaslam {

// A request of a viewer to a run or to the map that is shown.
struct ViewerCommand {
  enum class Kind {
    kPause,
    kStep,
    kReset,
    kRelocalize,
    kMapping,
    kPlaceAnchor,
    kEditAnchor,
    kRemoveAnchor
  };
  Kind kind = Kind::kStep;
  bool on = false;      // of kPause and kMapping
  AnchorRequest place;  // of kPlaceAnchor
  std::string anchor;   // of the other commands on anchors: the name
  AnchorEdit edit;

  bool IsOfAnchors() const { return kind >= Kind::kPlaceAnchor; }
};

// Parses a message of type "command", "place" or "anchor" (docs/viewer.md); nothing where it is not
// a message that our page sends.
std::optional<ViewerCommand> ParseCommand(const nlohmann::json& message);

}  // namespace oaslam
