#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "oaslam/anchors/editing.h"
#include "oaslam/odometry/odometry.h"
#include "oaslam/odometry/still_parts.h"
#include "oaslam/relocalization/depth_registration.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/relocalization/relocalizer.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/system/atlas.h"
#include "oaslam/system/object_audit.h"
#include "oaslam/system/present_lens.h"
#include "oaslam/system/repeated_images.h"
#include "oaslam/system/state_board.h"

namespace oaslam {

// The submaps, with the settings, the class names, the numbers of frames, and the states that
// other threads read.
class OASLAM_LOCAL Slam::Impl {
 public:
  Impl(const SlamConfig& config, const Camera& camera);
  ~Impl() { states_->Post(nullptr); }

  // Begins with another map, which is empty unless `is_loaded`; the settings stay. Throws before
  // anything is changed.
  void Begin(SavedMap saved, WorldId world, bool is_loaded);

  // The world of the main submap; of a submap, by its number.
  WorldId world() const { return WorldOf(atlas_->main_number()); }
  WorldId WorldOf(int submap) const;
  // The main submap is in a new world from now on.
  void BeginWorld() { worlds_[atlas_->main_number()] = NewWorld(); }
  std::vector<FormerWorld> FormerWorlds() const;

  // For functions that would change the map: throws MappingError where mapping has failed.
  void ExpectMapping();

  TrackingResult Process(const ImageInput& input);
  std::optional<int> AddDetections(int frame, const std::vector<Detection>& detections);
  Frame MakeFrame(const ImageInput& input, int index, int keypoints);
  RelocalizationResult Relocalize(const ImageInput& input, const RelocalizeOptions& options);
  void SetMask(const ImageMask& mask);
  void SetImu(const Rigid3& cam_from_imu);
  bool IsInImage(const Eigen::Vector2d& pixel) const;
  // The message that refuses a pixel outside of the image.
  std::string NotInImage(const Eigen::Vector2d& pixel) const;
  // Sets the ray of the pixel that the request names in the newest image. Returns why there is
  // none, or an empty text.
  std::string SetRay(const Map& map, AnchorRequest& request) const;
  // Edits the newest map's anchors, not those that the tracker sees: commands that are still queued
  // may change the scale of the map. `edited`: the anchor whose edit becomes an event.
  AnchorReport ChangeAnchors(
      const std::function<AnchorReport(const Map&, oaslam::Anchors&)>& change,
      const std::string& edited = "");

  Session& session() { return atlas_->main(); }
  const Session& session() const { return atlas_->main(); }
  MapSnapshot Snapshot() const {
    return snapshots_.Of(session().snapshot(), class_names_, first_index_, world());
  }
  // Posts the map to other threads after a change by another call than Process, with the newest
  // image's pose in it.
  void PostChange(const std::string& edited_anchor = "");
  // Slam::SetMetresPerUnit; `by_objects`: the evidence for the metre, nothing where the
  // user gave the metre.
  void SetMetresPerUnit(double metres, const std::optional<UnitEvidence>& by_objects);
  // As SetMetresPerUnit, where the map was joined with one in metres (Atlas::TakeMetre).
  void TakeMetre();
  // Scales the map to metres, once a sensor tells how long its unit is, and again where it tells
  // better. `is_last`: no image comes after this.
  void TakeSensorsMetre(bool is_last);

  SlamConfig config_;
  Camera camera_;
  FrameMaker frame_maker_;
  DepthRegistration depth_registration_;
  Relocalizer relocalizer_;
  std::optional<Odometry> odometry_;
  PresentLens lens_;
  ImageMask mask_;
  Rigid3 cam_from_imu_;
  std::optional<StillParts> still_parts_{std::in_place};  // nothing where the mask is given
  std::unique_ptr<Atlas> atlas_;
  std::vector<FramePose> loaded_trajectory_;
  MapRecordings loaded_recordings_;
  MapRecording recording_;  // what Process is given
  std::shared_ptr<const ClassNames> class_names_ =
      std::make_shared<const ClassNames>(CocoClassNames());
  std::shared_ptr<SlamStates::Board> states_ = std::make_shared<SlamStates::Board>();
  mutable SnapshotSeries snapshots_;
  TrackingResult newest_;  // the last result that was posted to other threads
  std::map<int, std::vector<FormerWorld>> former_worlds_;  // by number of the submap
  mutable std::map<int, WorldId> worlds_;  // by number of a submap that a result has named
  RelocalizationMode mode_ = RelocalizationMode::kPointsAndObjects;
  bool is_mapping_ = true;
  // Whether a call has thrown the MappingError already.
  bool has_told_failure_ = false;
  ObjectAudit audit_;
  int first_index_ = 0, next_index_ = 0;  // frames of a loaded map have smaller indices
  ObjectTrails trails_;                   // of the images followed by Relocalize
  // Time stamps of the last images of Process, and of Relocalize with `follow`.
  std::optional<double> last_timestamp_, last_followed_;

 private:
  Frame FrameOfBoxes(const ImageInput& input, double timestamp) const;
  RelocalizationResult Find(const Frame& frame, const RelocalizeOptions& options,
                            double ms_features);
  // The steps of Process.
  Frame MakeNextFrame(const ImageInput& input, double& cpu_ms);
  ImageInput Prepared(const ImageInput& input);
  Frame FeaturesBesideMotion(const ImageInput& grey, const std::shared_ptr<const DepthMap>& depth,
                             double& motion_cpu_ms);
  Frame FeaturesAfterMotion(const ImageInput& grey, const std::shared_ptr<const DepthMap>& depth);
  Frame WithFeatures(const ImageInput& grey);
  std::shared_ptr<const FrameMotion> FindMotion(const ImageInput& grey,
                                                const std::shared_ptr<const DepthMap>& depth);
  void TakeReplacedLens(const ImageInput& input, Frame& frame);
  TrackingResult MakeResult(const Frame& frame, const TrackingStep& step);
  void DoubtRepeated(TrackingResult& result);
  std::vector<PoseElsewhere> PosesElsewhere(const TrackingResult& result) const;
  void Post(const std::string& edited_anchor = "");
  ChangesBetweenStates NewInSubmaps();

  // What events have told of: the newest submap that began, by its number, and those joined with a
  // main one.
  int told_begun_ = -1;
  std::set<int> told_joined_;
  RepeatedImages repeated_images_;
  double repeated_s_ = 0;  // for how long the newest image has been the same
  bool is_repeating_ = false;
};

// Sets what a result tells of the pose.
void TakePose(const ImagePose& pose, TrackingResult& result);

}  // namespace oaslam
