#include "oaslam/service/route.h"

#include <algorithm>
#include <map>
#include <string_view>

namespace oaslam {

namespace {

struct Kind {
  Route route;
  const char *name, *methods;
};
constexpr const char* kReads = "GET, HEAD";
constexpr Kind kKinds[] = {{Route::kHealth, "healthz", kReads},
                           {Route::kMetrics, "metrics", kReads},
                           {Route::kOpenApi, "openapi", kReads},
                           {Route::kCamera, "camera", kReads},
                           {Route::kOdometry, "odometry", kReads},
                           {Route::kModel, "models", kReads},
                           {Route::kMaps, "maps", kReads},
                           {Route::kMap, "map", "GET, HEAD, PUT, DELETE"},
                           {Route::kLocalize, "localize", "POST"},
                           {Route::kAnchors, "anchors", "GET, HEAD, POST"},
                           {Route::kAnchor, "anchors", "PATCH, DELETE"},
                           {Route::kTrack, "track", kReads},
                           {Route::kRecord, "record", kReads},
                           {Route::kNowhere, "other", kReads}};

const Kind& KindOf(Route route) { return *std::ranges::find(kKinds, route, &Kind::route); }

}  // namespace

const char* NameOf(Route route) { return KindOf(route).name; }

std::string MethodsOf(Route route) { return KindOf(route).methods; }

Target TargetOf(const std::string& path) {
  constexpr std::string_view kModels = "/models/", kMaps = "/v1/maps/";
  static const std::map<std::string, Route> fixed{{"/healthz", Route::kHealth},
                                                  {"/metrics", Route::kMetrics},
                                                  {"/openapi.json", Route::kOpenApi},
                                                  {"/camera", Route::kCamera},
                                                  {"/oaslam_odometry.wasm", Route::kOdometry},
                                                  {"/", Route::kCamera},
                                                  {"/v1/maps", Route::kMaps}};
  if (const auto found = fixed.find(path); found != fixed.end()) return {found->second, "", ""};
  if (path.starts_with(kModels)) return {Route::kModel, "", path.substr(kModels.size())};
  if (!path.starts_with(kMaps)) return {};
  const std::string rest = path.substr(kMaps.size());
  const size_t slash = rest.find('/');
  const std::string map = rest.substr(0, slash);
  if (map.empty()) return {};
  if (slash == std::string::npos) return {Route::kMap, map, ""};
  const std::string part = rest.substr(slash + 1);
  static const std::map<std::string, Route> parts{{"localize", Route::kLocalize},
                                                  {"anchors", Route::kAnchors},
                                                  {"track", Route::kTrack},
                                                  {"record", Route::kRecord}};
  if (const auto found = parts.find(part); found != parts.end()) return {found->second, map, ""};
  constexpr std::string_view kAnchors = "anchors/";
  if (part.starts_with(kAnchors) && part.size() > kAnchors.size())
    return {Route::kAnchor, map, part.substr(kAnchors.size())};
  return {};
}

bool Allows(Route route, boost::beast::http::verb method) {
  const std::string methods = ", " + MethodsOf(route) + ",";
  return methods.find(", " + std::string(boost::beast::http::to_string(method)) + ",") !=
         std::string::npos;
}

Access AccessOf(Route route, boost::beast::http::verb method) {
  using boost::beast::http::verb;
  if (route == Route::kHealth || route == Route::kOpenApi || route == Route::kCamera ||
      route == Route::kOdometry || route == Route::kNowhere)
    return Access::kNone;
  if (route == Route::kRecord) return Access::kWrite;
  const bool reads = method == verb::get || method == verb::head || route == Route::kLocalize;
  return reads ? Access::kRead : Access::kWrite;
}

}  // namespace oaslam
