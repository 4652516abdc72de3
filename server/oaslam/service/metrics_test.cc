#include "oaslam/service/metrics.h"

#include <thread>
#include <vector>

#include "matchers.h"

namespace oaslam {
namespace {

TEST(Metrics, AreTextAsPrometheusReadsIt) {
  Metrics metrics;
  metrics.Count("requests_total", {{"route", "maps"}, {"status", "200"}});
  metrics.Count("found_total", {{"evidence", "points"}});
  metrics.Count("requests_total", {{"status", "404"}, {"route", "maps"}});
  metrics.Count("requests_total", {{"route", "maps"}, {"status", "200"}});
  for (const double seconds : {0.25, 0.005, 60.0}) metrics.Observe("localize_seconds", seconds);
  metrics.Text({{"workers", 3}});
  const std::string text = metrics.Text({{"maps_bytes", 123456789}, {"workers", 4}});
  for (const char* line :
       {"# TYPE requests_total counter\nrequests_total{route=\"maps\",status=\"",
        "requests_total{route=\"maps\",status=\"200\"} 2\n",
        "requests_total{route=\"maps\",status=\"404\"} 1\n",
        "# TYPE found_total counter\nfound_total{evidence=\"points\"} 1\n",
        "# TYPE maps_bytes gauge\nmaps_bytes 123456789\n", "# TYPE workers gauge\nworkers 4\n",
        "# TYPE localize_seconds histogram\n", "localize_seconds_bucket{le=\"0.005\"} 1\n",
        "localize_seconds_bucket{le=\"0.2\"} 1\n", "localize_seconds_bucket{le=\"0.5\"} 2\n",
        "localize_seconds_bucket{le=\"5\"} 2\n", "localize_seconds_bucket{le=\"+Inf\"} 3\n",
        "localize_seconds_sum 60.255\n", "localize_seconds_count 3\n"})
    EXPECT_THAT(text, HasSubstr(line));
}

TEST(Metrics, AreCountedByManyThreads) {
  Metrics metrics;
  {
    std::vector<std::jthread> threads;
    for (int i = 0; i < 4; ++i)
      threads.emplace_back([&] {
        for (int k = 0; k < 1000; ++k) {
          metrics.Count("all", {});
          metrics.Observe("seconds", 1);
          if (k % 100 == 0) metrics.Text({{"k", k}});
        }
      });
  }
  EXPECT_THAT(metrics.Text({}), HasSubstr("all 4000\n"));
  EXPECT_THAT(metrics.Text({}), HasSubstr("seconds_count 4000\n"));
}

}  // namespace
}  // namespace oaslam
