#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace oaslam {

// What the service counts, for Prometheus. Names and labels are words of the service's own, without
// characters that its format escapes. Thread-safe.
class Metrics {
 public:
  void Count(const std::string& name, const std::map<std::string, std::string>& labels);
  // A duration in seconds.
  void Observe(const std::string& name, double seconds);

  // The text format 0.0.4, with values of the moment besides: {name, value}.
  std::string Text(const std::map<std::string, double>& gauges) const;

 private:
  // From the fastest answer by points to a request with many images.
  static constexpr std::array<double, 10> kBounds{.005, .01, .02, .05, .1, .2, .5, 1, 2, 5};
  struct Histogram {
    std::array<uint64_t, kBounds.size()> at_most{};  // durations up to each bound
    uint64_t count = 0;
    double sum = 0;
  };

  mutable std::mutex mutex_;
  std::map<std::string, std::map<std::string, uint64_t>> counters_;  // by name and by labels
  std::map<std::string, Histogram> histograms_;
};

}  // namespace oaslam
