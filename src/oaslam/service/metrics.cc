#include "oaslam/service/metrics.h"

#include <fmt/format.h>

#include <iterator>

namespace oaslam {

void Metrics::Count(const std::string& name, const std::string& labels, double amount) {
  const std::scoped_lock lock(mutex_);
  counters_[{name, labels}] += amount;
}

void Metrics::Observe(const std::string& name, double seconds) {
  const std::scoped_lock lock(mutex_);
  Histogram& histogram = histograms_[name];
  for (size_t i = 0; i < std::size(kBounds); ++i) histogram.below[i] += seconds <= kBounds[i];
  ++histogram.count;
  histogram.sum += seconds;
}

std::string Metrics::Text(const std::map<std::string, double>& gauges) const {
  const std::scoped_lock lock(mutex_);
  std::string text, last;
  for (const auto& [key, value] : counters_) {
    if (key.first != last) text += fmt::format("# TYPE {} counter\n", key.first);
    last = key.first;
    text += fmt::format("{}{{{}}} {}\n", key.first, key.second, value);
  }
  for (const auto& [name, value] : gauges)
    text += fmt::format("# TYPE {} gauge\n{} {}\n", name, name, value);
  for (const auto& [name, histogram] : histograms_) {
    text += fmt::format("# TYPE {} histogram\n", name);
    for (size_t i = 0; i < std::size(kBounds); ++i)
      text += fmt::format("{}_bucket{{le=\"{}\"}} {}\n", name, kBounds[i], histogram.below[i]);
    text += fmt::format("{}_bucket{{le=\"+Inf\"}} {}\n{}_sum {}\n{}_count {}\n", name,
                        histogram.count, name, histogram.sum, name, histogram.count);
  }
  return text;
}

}  // namespace oaslam
