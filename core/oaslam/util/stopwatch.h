#pragma once

namespace oaslam {

// Milliseconds since construction: of the wall clock, and of the calling thread's CPU time.
class Stopwatch {
 public:
  Stopwatch();
  double WallMs() const;
  double ThreadCpuMs() const;

 private:
  double wall_ms_, cpu_ms_;
};

// Seconds of std::chrono::steady_clock.
double SteadySeconds();
// CPU seconds of the whole process, user and system; peak resident memory in MiB.
double ProcessCpuSeconds();
double PeakRssMb();

}  // namespace oaslam
