#include "oaslam/service/route.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "oaslam/service/openapi.h"

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
  const auto api = nlohmann::json::parse(OpenApi());
  for (const auto& [path, operations] : api["paths"].items())
    for (const auto& [method, operation] : operations.items())
      if (method != "parameters") described.emplace(TargetOf(path).route, Upper(method));
  EXPECT_EQ(described, Known());
}

}  // namespace
}  // namespace oaslam
