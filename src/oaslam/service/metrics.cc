#include "oaslam/service/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/text_serializer.h>

namespace oaslam {

// A metric that is registered a second time is the first one.

void Metrics::Count(const std::string& name, const std::map<std::string, std::string>& labels) {
  prometheus::BuildCounter().Name(name).Register(registry_).Add(labels).Increment();
}

void Metrics::Observe(const std::string& name, double seconds) {
  // From the fastest answer by points to a request with many images.
  const prometheus::Histogram::BucketBoundaries bounds{.005, .01, .02, .05, .1, .2, .5, 1, 2, 5};
  prometheus::BuildHistogram().Name(name).Register(registry_).Add({}, bounds).Observe(seconds);
}

std::string Metrics::Text(const std::map<std::string, double>& gauges) {
  for (const auto& [name, value] : gauges)
    prometheus::BuildGauge().Name(name).Register(registry_).Add({}).Set(value);
  return prometheus::TextSerializer().Serialize(registry_.Collect());
}

}  // namespace oaslam
