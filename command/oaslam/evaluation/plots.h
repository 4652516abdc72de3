#pragma once

#include <string>
#include <vector>

#include "oaslam/evaluation/relocalization_metrics.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// Draws both trajectories from above, in the frame of the reference.
void SaveTrajectoryPlot(const std::string& path, const std::vector<StampedPose>& reference,
                        const std::vector<StampedPose>& aligned_estimate, const std::string& title);

// Draws the share of frames localized within a distance of 0 to 1 m, with a curve for each method.
void SaveRecallPlot(const std::string& path, const std::vector<RelocalizationErrors>& curves,
                    const std::string& title);

}  // namespace oaslam
