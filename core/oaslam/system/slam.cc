#include "oaslam/slam.h"

#include <cmath>
#include <utility>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/joining.h"
#include "oaslam/objects/object_edit.h"
#include "oaslam/relocalization/image_search.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/system/slam_impl.h"
#include "oaslam/system/slam_view.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {

Slam::Slam(const SlamConfig& config, const Camera& camera) {
  CheckConfig(config);
  CheckCamera(camera);
  impl_ = std::make_unique<Impl>(config, camera);
}
Slam::~Slam() = default;
Slam::Slam(Slam&&) noexcept = default;
Slam& Slam::operator=(Slam&&) noexcept = default;

TrackingResult Slam::Process(const ImageInput& input) { return impl_->Process(input); }

std::optional<int> Slam::AddDetections(int frame, const std::vector<Detection>& detections) {
  return impl_->AddDetections(frame, detections);
}

void Slam::SetRelocalizationMode(RelocalizationMode mode) {
  CheckMode(mode);
  impl_->mode_ = mode;
  impl_->atlas_->SetRelocalizationMode(mode);
}

RelocalizationResult Slam::Relocalize(const ImageInput& input, const RelocalizeOptions& options) {
  CheckOptions(options, input);
  RelocalizationResult result = impl_->Relocalize(input, options);
  result.world = impl_->world();
  return result;
}

void Slam::SetMapping(bool enabled) {
  impl_->is_mapping_ = enabled;
  impl_->atlas_->SetMapping(enabled);
  impl_->PostChange();
}

void Slam::ForceRelocalization(const std::optional<Rigid3>& near) {
  CheckPose(near);
  impl_->atlas_->ForceRelocalization(near);
  impl_->trails_ = {};
  impl_->PostChange();
}

std::shared_ptr<const Slam::View> Slam::NewestView() const {
  const Session& session = impl_->atlas_->main();
  auto view = std::make_shared<View>(View{session.tracker().View()});
  view->map = session.snapshot();
  return view;
}

void Slam::SetClassNames(std::map<int, std::string> names) {
  impl_->class_names_ = std::make_shared<const ClassNames>(std::move(names));
  impl_->PostChange();
}

void Slam::SetClassRelations(const ClassRelations& relations) {
  if (const auto part = PartOfItself(relations.whole_of))
    throw BadInput("class {} is a part of itself", *part);
  impl_->ExpectMapping();
  impl_->atlas_->SetClassRelations(relations);
  impl_->PostChange();
  impl_->ExpectMapping();
}

std::vector<AnchorPose> Slam::Anchors() const {
  std::vector<AnchorPose> anchors = PosesOf(*impl_->session().snapshot());
  if (const auto world_from_cam = impl_->newest_.PoseIn(impl_->world()))
    for (AnchorPose& anchor : anchors)
      anchor.cam_from_anchor = world_from_cam->Inverse() * anchor.world_from_anchor;
  return anchors;
}

std::vector<RayHit> Slam::Cast(const Eigen::Vector2d& pixel) const {
  if (!impl_->IsInImage(pixel)) throw BadInput("{}", impl_->NotInImage(pixel));
  const MapSnapshot map = impl_->Snapshot();
  AnchorRequest ray{.pixel = pixel};
  const bool has_pose = impl_->SetRay(*impl_->session().snapshot(), ray).empty();
  return has_pose ? map.Cast(ray.origin, ray.direction) : std::vector<RayHit>();
}

AnchorReport Slam::PlaceAnchor(const AnchorRequest& request) {
  return impl_->ChangeAnchors([&](const Map& map, oaslam::Anchors& anchors) -> AnchorReport {
    if (!request.pixel || request.pose) return oaslam::PlaceAnchor(map, request, anchors);
    AnchorRequest by_ray = request;
    if (std::string problem = impl_->SetRay(map, by_ray); !problem.empty())
      return {"", std::move(problem)};
    return oaslam::PlaceAnchor(map, by_ray, anchors);
  });
}

AnchorReport Slam::EditAnchor(const std::string& name, const AnchorEdit& edit) {
  const bool changes = edit.model || edit.size || edit.pose || edit.turn_rad != 0;
  return impl_->ChangeAnchors(
      [&](const Map& map, oaslam::Anchors& anchors) {
        return oaslam::EditAnchor(map, name, edit, anchors);
      },
      changes ? name : "");
}

AnchorReport Slam::RemoveAnchor(const std::string& name) {
  return impl_->ChangeAnchors(
      [&](const Map&, oaslam::Anchors& anchors) { return oaslam::RemoveAnchor(name, anchors); });
}

void Slam::EditObject(ObjectId object, const ObjectEdit& edit) {
  impl_->session().Submit(AdoptAdjustment{});  // nothing moves the map between trial and edit
  Map trial = *impl_->session().snapshot();
  oaslam::EditObject(trial, object, edit, impl_->config_.objects);  // throws for a wrong request
  impl_->ExpectMapping();
  impl_->session().Submit(ObjectChange{object, edit});
  impl_->PostChange();
  impl_->ExpectMapping();
}

std::vector<ObjectPresence> Slam::Presence() const { return impl_->audit_.Report(); }

void Slam::Finish() {
  const std::string why_no_map = impl_->session().tracker().why_no_map();
  impl_->atlas_->Finish();
  impl_->PostChange();
  impl_->TakeMetre();
  impl_->TakeSensorsMetre(true);
  if (impl_->session().snapshot()->keyframes.empty() && !why_no_map.empty())
    Log(LogLevel::kWarning,
        "no map was made: {}; it takes a camera that moves sideways past things with "
        "texture, neither too fast nor too dark",
        why_no_map);
  if (!impl_->has_told_failure_) impl_->ExpectMapping();
}

void Slam::SetMetresPerUnit(double metres) { impl_->SetMetresPerUnit(metres, std::nullopt); }

void Slam::SetMetresPerUnit(const ScaleEstimate& estimate) {
  if (!estimate.success) throw InputError("metres per unit: not known: " + estimate.why_not);
  // A map with other numbers would not be read again.
  if (!(std::isfinite(estimate.relative_sigma) && estimate.relative_sigma >= 0))
    throw BadInput("metres per unit: relative sigma {}, allowed: from 0 on and finite",
                   estimate.relative_sigma);
  if (estimate.objects < 1 || estimate.classes < 1)
    throw BadInput("metres per unit: by {} objects of {} classes, allowed: 1 or more",
                   estimate.objects, estimate.classes);
  impl_->SetMetresPerUnit(
      estimate.metres_per_unit,
      UnitEvidence{estimate.relative_sigma, estimate.objects, estimate.classes});
}

std::vector<StampedPose> Slam::Trajectory() const {
  const Session& session = impl_->session();
  return WorldPoses(*session.snapshot(), session.tracker().trajectory(), impl_->first_index_);
}

GyroscopeCalibration Slam::Gyroscope() const { return impl_->odometry_->gyroscope().calibration(); }

void Slam::SetImu(const Rigid3& cam_from_imu) { impl_->SetImu(cam_from_imu); }

std::vector<FormerWorld> Slam::FormerWorlds() const { return impl_->FormerWorlds(); }

ImuCalibration Slam::Imu() const { return impl_->odometry_->imu(); }

MapSnapshot Slam::WholeMap() const {
  const Impl& impl = *impl_;
  SavedMap saved{*impl.atlas_->main().Mapped(), impl.loaded_trajectory_, *impl.class_names_,
                 impl.atlas_->Others()};
  for (Submap& submap : saved.submaps) NumberCameras(saved.map.cameras, submap.map);
  for (Submap& submap : saved.submaps) submap.map.cameras = saved.map.cameras;
  FollowUnits(saved.map, saved.trajectory);
  AdoptPoses(impl.session().tracker().trajectory(), 1, saved.trajectory);
  saved.recordings = impl.loaded_recordings_;
  if (FramesOf(saved) > impl.first_index_) saved.recordings.push_back(impl.recording_);
  return SnapshotOf(std::move(saved), impl.world(), impl.Snapshot().version());
}

void Slam::SetMask(const cv::Mat& mask) {
  Impl& impl = *impl_;
  if (mask.empty()) {
    impl.still_parts_.emplace();
    return impl.SetMask({});
  }
  if (mask.type() != CV_8UC1 || mask.cols != impl.camera_.width || mask.rows != impl.camera_.height)
    throw BadInput("mask: {}x{} pixels of {} bytes, allowed: {}x{} of 1 (grey)", mask.cols,
                   mask.rows, mask.elemSize(), impl.camera_.width, impl.camera_.height);
  const ImageMask checked(ViewOf(mask));
  if (checked.HiddenShare() >= 1) throw InputError("mask: hides the whole image: 0 hides");
  impl.still_parts_.reset();
  impl.SetMask(checked);
}

void Slam::NameRecording(const std::string& name, const std::string& images) {
  impl_->recording_.name = name;
  impl_->recording_.images = images;
}

void Slam::Save(const std::string& path) const {
  if (impl_->session().snapshot()->keyframes.empty())
    Log(LogLevel::kWarning, "{}: the map that is saved is empty", path);
  WholeMap().Save(path);
}

void Slam::Load(const std::string& path, int submap) { Load(MapSnapshot::Load(path, submap)); }

void Slam::Load(const MapSnapshot& map) {
  if (map.Keyframes().size() == 0)
    Log(LogLevel::kWarning, "the map that is loaded is empty: no camera will be found in it");
  impl_->Begin(SavedMapOf(map), map.world(), true);
  const std::shared_ptr<const LandmarkIndex>& index = map.content()->index;
  if (!index) return;
  impl_->session().tracker().Use(index);
  impl_->relocalizer_.Use(index);
}

void Slam::Reset() {
  SavedMap empty;
  empty.map.classes = impl_->session().snapshot()->classes;
  impl_->Begin(std::move(empty), NewWorld(), false);
}

MapSnapshot Slam::Snapshot() const { return impl_->Snapshot(); }

SlamStates Slam::States() const { return SlamStates(impl_->states_); }

std::vector<TrackedPoint> Slam::TrackedPoints() const {
  const FrameView view = impl_->session().tracker().View();
  std::vector<TrackedPoint> points;
  if (!view.frame.features) return points;
  const Features& features = *view.frame.features;
  const Map& map = *impl_->session().snapshot();
  for (size_t i = 0; i < features.keypoints.size(); ++i) {
    const Keypoint& keypoint = features.keypoints[i];
    TrackedPoint point;
    point.pixel = Distort(impl_->camera_, keypoint.px.cast<double>());
    point.sigma_px = features.pyramid.scale[keypoint.octave];
    const Landmark* landmark =
        view.landmarks.empty() ? nullptr : map.landmarks.Find(view.landmarks[i]);
    if (landmark) {
      point.landmark = view.landmarks[i];
      point.position = landmark->position;
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace oaslam
