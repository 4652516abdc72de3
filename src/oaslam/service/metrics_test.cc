#include "oaslam/service/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <sstream>
#include <thread>
#include <vector>

namespace oaslam {
namespace {

using testing::HasSubstr;

TEST(Metrics, AreTextAsPrometheusReadsIt) {
  Metrics metrics;
  metrics.Count("requests_total", R"(route="maps",status="200")");
  metrics.Count("found_total", R"(evidence="points")", 0.5);
  metrics.Count("requests_total", R"(route="maps",status="404")", 2);
  metrics.Count("requests_total", R"(route="maps",status="200")");
  metrics.Observe("localize_seconds", 0.25);
  metrics.Observe("localize_seconds", 0.005);
  metrics.Observe("localize_seconds", 60);
  EXPECT_EQ(metrics.Text({{"maps_bytes", 123456789}, {"workers", 4}}),
            "# TYPE found_total counter\n"
            "found_total{evidence=\"points\"} 0.5\n"
            "# TYPE requests_total counter\n"
            "requests_total{route=\"maps\",status=\"200\"} 2\n"
            "requests_total{route=\"maps\",status=\"404\"} 2\n"
            "# TYPE maps_bytes gauge\n"
            "maps_bytes 123456789\n"
            "# TYPE workers gauge\n"
            "workers 4\n"
            "# TYPE localize_seconds histogram\n"
            "localize_seconds_bucket{le=\"0.005\"} 1\n"
            "localize_seconds_bucket{le=\"0.01\"} 1\n"
            "localize_seconds_bucket{le=\"0.02\"} 1\n"
            "localize_seconds_bucket{le=\"0.05\"} 1\n"
            "localize_seconds_bucket{le=\"0.1\"} 1\n"
            "localize_seconds_bucket{le=\"0.2\"} 1\n"
            "localize_seconds_bucket{le=\"0.5\"} 2\n"
            "localize_seconds_bucket{le=\"1\"} 2\n"
            "localize_seconds_bucket{le=\"2\"} 2\n"
            "localize_seconds_bucket{le=\"5\"} 2\n"
            "localize_seconds_bucket{le=\"+Inf\"} 3\n"
            "localize_seconds_sum 60.255\n"
            "localize_seconds_count 3\n");
}

// A metric is in one group, which its type leads, also where the name of another begins with its
// own.
TEST(Metrics, EachIsInOneGroup) {
  Metrics metrics;
  for (const char* name : {"b", "a", "a_b", "a", "b"})
    for (const char* label : {"x=\"2\"", "x=\"1\""}) metrics.Count(name, label);
  std::istringstream lines(metrics.Text({}));
  std::vector<std::string> groups;
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, std::regex("# TYPE (\\w+) counter")))
      groups.push_back(match[1]);
    else
      EXPECT_THAT(line, HasSubstr(groups.back() + "{"));
  }
  EXPECT_THAT(groups, testing::ElementsAre("a", "a_b", "b"));
}

TEST(Metrics, AreCountedByManyThreads) {
  Metrics metrics;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&] {
        for (int k = 0; k < 1000; ++k) {
          metrics.Count("all", "");
          metrics.Observe("seconds", 1);
          if (k % 100 == 0) metrics.Text({});
        }
      });
  }
  EXPECT_THAT(metrics.Text({}), HasSubstr("all{} 4000\n"));
  EXPECT_THAT(metrics.Text({}), HasSubstr("seconds_count 4000\n"));
}

}  // namespace
}  // namespace oaslam
