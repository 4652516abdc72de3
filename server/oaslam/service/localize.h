#pragma once

#include <vector>

#include "oaslam/service/service_state.h"

namespace oaslam {

// Answers one image; an image or a camera that cannot be used throws InputError.
struct Localized {
  RelocalizationResult result;
  std::optional<Camera> camera;  // the one that was used or found
};
Localized Localize(ServiceState& state, const ServedMap& map, const ImageRequest& request,
                   RelocalizationMode mode);

// The body of POST /v1/maps/{map}/localize: the answer as JSON.
Json AnswerLocalize(ServiceState& state, const ServedMap& map,
                    const std::vector<ImageRequest>& images, RelocalizationMode mode);

// Reads the request, an image or JSON. Throws InputError.
struct LocalizeRequest {
  std::vector<ImageRequest> images;
  RelocalizationMode mode = RelocalizationMode::kPointsAndObjects;
};
LocalizeRequest ReadLocalizeRequest(HttpRequest request);

}  // namespace oaslam
