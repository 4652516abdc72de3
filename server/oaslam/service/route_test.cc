#include "oaslam/service/route.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "oaslam/net/gzipped.h"
#include "oaslam/service/documents.h"

namespace oaslam {
namespace {

using Operations = std::set<std::pair<Route, std::string>>;

std::string Upper(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// The methods that each route knows. HEAD is left out, which the description tells of all paths.
Operations Known() {
  Operations known;
  for (int route = 0; route < static_cast<int>(Route::kNowhere); ++route)
    for (const auto method : {boost::beast::http::verb::get, boost::beast::http::verb::put,
                              boost::beast::http::verb::post, boost::beast::http::verb::patch,
                              boost::beast::http::verb::delete_})
      if (Allows(static_cast<Route>(route), method))
        known.emplace(static_cast<Route>(route),
                      std::string(boost::beast::http::to_string(method)));
  return known;
}

TEST(Route, IsInTheDescriptionWithItsMethods) {
  Operations described;
  const auto api = nlohmann::json::parse(Gunzip(OpenApi()));
  for (const auto& [path, operations] : api["paths"].items())
    for (const auto& [method, operation] : operations.items())
      if (method != "parameters") described.emplace(TargetOf(path).route, Upper(method));
  EXPECT_EQ(described, Known());
}

TEST(Route, PathsNameWhatTheyAreOf) {
  const auto expect = [](const std::string& path, Route route, const std::string& map = "",
                         const std::string& rest = "") {
    const Target target = TargetOf(path);
    EXPECT_EQ(target.route, route) << path;
    EXPECT_EQ(target.map, map) << path;
    EXPECT_EQ(target.rest, rest) << path;
  };
  expect("/", Route::kCamera);
  expect("/oaslam_odometry.wasm", Route::kOdometry);
  expect("/models/lamp/a/b.bin", Route::kModel, "", "lamp/a/b.bin");
  expect("/v1/maps", Route::kMaps);
  expect("/v1/maps/desk", Route::kMap, "desk");
  expect("/v1/maps/localize", Route::kMap, "localize");
  expect("/v1/maps/desk/localize", Route::kLocalize, "desk");
  expect("/v1/maps/desk/anchors", Route::kAnchors, "desk");
  expect("/v1/maps/desk/anchors/a/flag /x", Route::kAnchor, "desk", "a/flag /x");
  for (const char* path : {"", "v1/maps", "//", "/healthz/", "/models", "/v1/", "/v1/maps/",
                           "/v1/maps//localize", "/v1/maps/desk/", "/v1/maps/desk/anchors/",
                           "/v1/maps/desk/localize/", "/V1/maps", "/v2/maps"})
    expect(path, Route::kNowhere);
}

TEST(Route, MethodsAreWholeWords) {
  using boost::beast::http::verb;
  EXPECT_TRUE(Allows(Route::kMap, verb::put));
  EXPECT_TRUE(Allows(Route::kMap, verb::head));
  EXPECT_FALSE(Allows(Route::kMaps, verb::put));
  EXPECT_FALSE(Allows(Route::kLocalize, verb::get));
  EXPECT_FALSE(Allows(Route::kMap, verb::unknown));
  EXPECT_FALSE(Allows(Route::kMap, verb::options));
}

}  // namespace
}  // namespace oaslam
