#include "oaslam/service/metrics.h"

#include <fmt/format.h>

namespace oaslam {

void Metrics::Count(const std::string& name, const std::map<std::string, std::string>& labels) {
  std::string text;
  for (const auto& [label, value] : labels)
    text += fmt::format("{}{}=\"{}\"", text.empty() ? "{" : ",", label, value);
  if (!text.empty()) text += "}";
  const std::scoped_lock lock(mutex_);
  ++counters_[name][text];
}

void Metrics::Observe(const std::string& name, double seconds) {
  const std::scoped_lock lock(mutex_);
  Histogram& histogram = histograms_[name];
  for (size_t i = 0; i < kBounds.size(); ++i)
    if (seconds <= kBounds[i]) ++histogram.at_most[i];
  ++histogram.count;
  histogram.sum += seconds;
}

std::string Metrics::Text(const std::map<std::string, double>& gauges) const {
  const std::scoped_lock lock(mutex_);
  std::string text;
  for (const auto& [name, counts] : counters_) {
    text += fmt::format("# TYPE {} counter\n", name);
    for (const auto& [labels, count] : counts)
      text += fmt::format("{}{} {}\n", name, labels, count);
  }
  for (const auto& [name, value] : gauges)
    text += fmt::format("# TYPE {0} gauge\n{0} {1}\n", name, value);
  for (const auto& [name, histogram] : histograms_) {
    text += fmt::format("# TYPE {} histogram\n", name);
    for (size_t i = 0; i < kBounds.size(); ++i)
      text += fmt::format("{}_bucket{{le=\"{}\"}} {}\n", name, kBounds[i], histogram.at_most[i]);
    text += fmt::format("{0}_bucket{{le=\"+Inf\"}} {1}\n{0}_sum {2}\n{0}_count {1}\n", name,
                        histogram.count, histogram.sum);
  }
  return text;
}

}  // namespace oaslam
