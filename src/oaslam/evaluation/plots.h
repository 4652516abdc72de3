#pragma once

#include <string>
#include <vector>

#include "oaslam/evaluation/reliability.h"
#include "oaslam/evaluation/relocalization_metrics.h"
#include "oaslam/formats/trajectory_file.h"

namespace oaslam {

// Both from above, in the frame of the reference.
void SaveTrajectoryPlot(const std::string& path, const std::vector<StampedPose>& reference,
                        const std::vector<StampedPose>& aligned_estimate, const std::string& title);

// A line over time.
struct TimeCurve {
  std::string name;
  std::vector<std::pair<double, double>> points;  // seconds, value
};

// Position errors [m] over time.
void SaveErrorPlot(const std::string& path, const std::vector<TimeCurve>& curves,
                   const std::string& title);

// The share of frames that were localized within a distance, from 0 to 1 m: a curve for each.
void SaveRecallPlot(const std::string& path, const std::vector<RelocalizationErrors>& curves,
                    const std::string& title);

// How often hypotheses are right against how confident the program was: a line for each; on the
// diagonal where it is calibrated.
struct ReliabilityCurve {
  std::string name;
  Reliability reliability;
};
void SaveReliabilityPlot(const std::string& path, const std::vector<ReliabilityCurve>& curves,
                         const std::string& title);

}  // namespace oaslam
