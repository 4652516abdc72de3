#pragma once

#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// A pose and the time of its image, seconds.
struct StampedPose {
  double timestamp = 0;
  Rigid3 world_from_cam;
};

// TUM format: "timestamp tx ty tz qx qy qz qw" in each line, camera to world; '#' starts a comment.
// Time stamps that are dates may be in ms, us or ns. EuRoC's ground truth (commas, qw first) and
// KITTI's poses (with their times.txt beside them) are read, too. Sorted by time on return. Throws
// InputError naming path and line.
OASLAM_API std::vector<StampedPose> LoadTrajectory(const std::string& path);
// Writes a trajectory in TUM format. Throws InputError where the file cannot be written, or a
// number of a pose is not finite.
OASLAM_API void SaveTrajectory(const std::string& path, const std::vector<StampedPose>& poses);

// A candidates.txt line: TUM columns and a score.
struct ScoredPose {
  StampedPose pose;
  double score = 0;
};
// Writes the lines of a candidates.txt. Throws InputError where the file cannot be written.
OASLAM_API void SaveScoredPoses(const std::string& path, const std::vector<ScoredPose>& poses);
// Reads the lines of a candidates.txt. Throws InputError naming path and line.
OASLAM_API std::vector<ScoredPose> LoadScoredPoses(const std::string& path);

}  // namespace oaslam
