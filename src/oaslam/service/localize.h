#pragma once

#include <string>
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

// POST /geopose: the answer of the GeoPose protocol, and the HTTP status. All maps with a
// georeference are asked, those first that the device believes to be near.
struct GeoPoseReply {
  int status = 200;
  std::string body;
};
GeoPoseReply AnswerGeoPose(ServiceState& state, const std::string& body);

}  // namespace oaslam
