#pragma once

#include <prometheus/registry.h>

#include <map>
#include <string>

namespace oaslam {

// What the service counts, for Prometheus. Thread-safe.
class Metrics {
 public:
  void Count(const std::string& name, const std::map<std::string, std::string>& labels);
  // A duration in seconds.
  void Observe(const std::string& name, double seconds);

  // The text format 0.0.4, with values of the moment besides: {name, value}.
  std::string Text(const std::map<std::string, double>& gauges);

 private:
  prometheus::Registry registry_;
};

}  // namespace oaslam
