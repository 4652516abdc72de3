#pragma once

#include <string_view>

namespace oaslam {

// data/models.json.
std::string_view ModelCatalogueText();

}  // namespace oaslam
