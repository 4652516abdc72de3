#pragma once

#include <string>

#include "oaslam/net/http_service.h"

namespace oaslam {

// The kinds of paths of the service (docs/service.md).
enum class Route {
  kHealth,
  kMetrics,
  kOpenApi,
  kCamera,
  kOdometry,
  kModel,
  kMaps,
  kMap,
  kLocalize,
  kAnchors,
  kAnchor,
  kTrack,
  kRecord,
  kNowhere
};

// What a path names.
struct Target {
  Route route = Route::kNowhere;
  std::string map, rest;  // `rest`: the name of an anchor, or the path of a model
};

Target TargetOf(const std::string& path);

// As in the metrics.
const char* NameOf(Route route);

// The methods that a path of this kind knows, in the form of the header Allow.
std::string MethodsOf(Route route);
bool Allows(Route route, boost::beast::http::verb method);

// What the token of a caller must allow.
Access AccessOf(Route route, boost::beast::http::verb method);

}  // namespace oaslam
