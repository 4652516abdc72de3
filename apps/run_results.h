#pragma once

#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/io/map_file.h"
#include "oaslam/io/trajectory_file.h"
#include "oaslam/slam.h"

namespace oaslam::apps {

// The folder that `oaslam run` fills (docs/formats.md). Frames are written as they come, the rest by Finish.
class RunResults {
 public:
  RunResults(const std::string& folder, const SlamConfig& config);

  void Add(int source_index, const TrackingResult& result);
  // `interrupted`: the run ended early; what there is gets written all the same.
  void Finish(const SavedMap& saved, const std::vector<StampedPose>& groundtruth, double wall_s, bool interrupted);
  int tracked() const { return tracked_; }

 private:
  std::string folder_;
  SlamConfig config_;
  std::ofstream frames_;
  std::vector<StampedPose> live_;
  std::vector<double> ms_;
  int frame_count_ = 0, tracked_ = 0;
};

// The final poses of the frames of a trajectory that the map can still place.
std::vector<StampedPose> FinalTrajectory(const Map& map, const std::vector<FramePose>& trajectory);
std::vector<StampedPose> KeyframeTrajectory(const Map& map);

}  // namespace oaslam::apps
