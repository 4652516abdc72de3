#pragma once

#include <optional>
#include <string>
#include <vector>

#include "frame_inputs.h"
#include "oaslam/camera_estimation.h"
#include "oaslam/map/firm_parts.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"

namespace oaslam::apps {

// The folder that `oaslam run` fills (docs/formats.md).
class RunResults {
 public:
  RunResults(const std::string& folder, const SlamConfig& config);

  void Add(int source_index, const TrackingResult& result) {
    frames_.emplace_back(source_index, result);
  }
  // Of a camera: the age of an image when its results are shown, seconds.
  void AddAge(double age_s) { ages_s_.push_back(age_s); }
  // Records the detections that came later for a frame that was added before.
  void Detected(int frame, int detections, std::optional<int> objects);
  // The images of the run, so that they are found again; empty: not recorded.
  void SetImages(std::string images) { images_ = std::move(images); }
  // `wall_s`: the wall time during which the detector could work.
  void SetDetectorPace(const DetectorPace& pace, double wall_s) {
    pace_ = pace;
    detector_wall_s_ = wall_s;
  }
  void SetCamera(const Camera& camera, const std::optional<CameraEstimate>& estimate) {
    camera_ = camera;
    estimate_ = estimate;
  }
  // The map's world at the end of the run, in whose unit all is written, and the worlds that it
  // was.
  void SetWorld(WorldId world, const std::vector<FormerWorld>& former);
  // Converts live poses to a new unit: one old unit is `factor` new ones.
  void Scale(double factor);
  // How many images have a pose that was uncertain when it was given, and in which seconds; empty:
  // none.
  std::string Uncertain() const;
  // Which stretches of the map hang by a loose link, and what would tie them; empty: none. Known
  // after Finish.
  std::string Loose() const;
  // `interrupted`: the run ended early; its results are written nevertheless. Returns the number of
  // frames with a final pose. `submaps`: the trajectories of those of `saved`.
  size_t Finish(const SavedMap& saved, const std::vector<StampedPose>& trajectory,
                const std::vector<std::vector<StampedPose>>& submaps,
                const std::vector<StampedPose>& groundtruth, double wall_s, bool interrupted);

 private:
  void WriteFrames(const std::vector<StampedPose>& trajectory) const;
  void WriteCamera() const;
  void TakePosesInWorld();
  void WriteSubmaps(const std::vector<std::vector<StampedPose>>& submaps) const;

  std::string folder_;
  SlamConfig config_;
  Camera camera_;
  std::optional<CameraEstimate> estimate_;
  WorldId world_;
  std::vector<LooseStretch> loose_;
  std::string images_;
  DetectorPace pace_;
  double detector_wall_s_ = 0;
  std::vector<double> ages_s_;
  std::vector<std::pair<int, TrackingResult>> frames_;  // by index in the source
};

}  // namespace oaslam::apps
