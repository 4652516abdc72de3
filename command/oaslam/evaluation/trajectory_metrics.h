#pragma once

#include <string>
#include <vector>

#include "oaslam/evaluation/alignment.h"

namespace oaslam {

struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
  size_t count = 0;
};

ErrorStatistics StatisticsOf(std::vector<double> errors);

// Absolute trajectory error (Sturm et al. 2012): distance of the aligned positions.
struct TrajectoryReport {
  bool success = false;
  std::string why_not;
  size_t pairs = 0;
  Alignment reference_from_estimate;
  ErrorStatistics position;  // units of the reference
  ErrorStatistics rotation_deg;
  std::vector<std::pair<double, double>> position_errors;  // time stamp and error, ascending
};

TrajectoryReport EvaluateTrajectory(const std::vector<StampedPose>& reference,
                                    const std::vector<StampedPose>& estimate, AlignMode mode);

// Whether positions are as certain as was stated: the squared error over its variance (normalised
// estimation error squared, Bar-Shalom, Li and Kirubarajan 2001, here divided by its degrees of
// freedom).
struct ConsistencyReport {
  double median = 0;        // 0.8 where the errors are Gaussian as stated
  double share_beyond = 0;  // of the positions that are off by more than three sigmas
  size_t count = 0;
};

// `sigmas`: time stamp and standard deviation (of the distance), units of the estimate, ascending.
// Poses without a sigma do not count.
ConsistencyReport EvaluateConsistency(const TrajectoryReport& report,
                                      const std::vector<std::pair<double, double>>& sigmas);

// Relative pose error (Sturm et al. 2012): the error of the motion over an interval, with the
// estimate scaled by `scale`.
struct RelativeReport {
  ErrorStatistics translation;  // units of the reference
  ErrorStatistics rotation_deg;
};

// `interval_s`: 0 for neighbouring frames (of which those across a gap are left out).
RelativeReport EvaluateRelative(const std::vector<StampedPose>& reference,
                                const std::vector<StampedPose>& estimate, double scale,
                                double interval_s);

}  // namespace oaslam
