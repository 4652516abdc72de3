#pragma once

#include <optional>
#include <string>

#include "oaslam/map/anchor.h"

namespace oaslam {

// Throws InputError where a store cannot keep this edit: a name or a model that is not 1 to 64
// bytes of UTF-8 without control characters, or a number that is not finite.
void CheckAnchorEdit(const std::string& name, const std::optional<Anchor>& anchor);

}  // namespace oaslam
