#include "oaslam/util/stopwatch.h"

#include <sys/resource.h>
#include <time.h>

#include <chrono>

namespace oaslam {
namespace {

double ClockMs(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

}  // namespace

Stopwatch::Stopwatch()
    : wall_ms_(ClockMs(CLOCK_MONOTONIC)), cpu_ms_(ClockMs(CLOCK_THREAD_CPUTIME_ID)) {}

double Stopwatch::WallMs() const { return ClockMs(CLOCK_MONOTONIC) - wall_ms_; }

double Stopwatch::ThreadCpuMs() const { return ClockMs(CLOCK_THREAD_CPUTIME_ID) - cpu_ms_; }

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double ProcessCpuSeconds() { return ClockMs(CLOCK_PROCESS_CPUTIME_ID) * 1e-3; }

double PeakRssMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace oaslam
