#pragma once

#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace oaslam {

// What the service counts, for Prometheus. Thread-safe.
class Metrics {
 public:
  // A counter with labels as they are written: route="localize",status="200".
  void Count(const std::string& name, const std::string& labels, double amount = 1);
  // A duration in seconds.
  void Observe(const std::string& name, double seconds);

  // The text format 0.0.4, with values of the moment besides: {name, value}.
  std::string Text(const std::map<std::string, double>& gauges) const;

 private:
  static constexpr double kBounds[] = {.005, .01, .02, .05, .1, .2, .5, 1, 2, 5};
  struct Histogram {
    uint64_t below[std::size(kBounds)] = {};  // each bound
    uint64_t count = 0;
    double sum = 0;
  };

  mutable std::mutex mutex_;
  std::map<std::pair<std::string, std::string>, double> counters_;
  std::map<std::string, Histogram> histograms_;
};

}  // namespace oaslam
