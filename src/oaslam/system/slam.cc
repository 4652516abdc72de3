#include "oaslam/slam.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <stdexcept>

#include "oaslam/anchors/editing.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/system/atlas.h"
#include "oaslam/system/frame_maker.h"
#include "oaslam/system/localizer.h"
#include "oaslam/system/object_audit.h"
#include "oaslam/system/relocalizer.h"
#include "oaslam/system/slam_access.h"
#include "oaslam/system/snapshot_maker.h"
#include "oaslam/system/state_board.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

// The exception that Slam throws to its caller.
MappingError ErrorOf(const std::exception_ptr& failure) {
  std::string what = "unknown error";
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& error) {
    what = error.what();
  } catch (...) {
  }
  return MappingError(fmt::format("mapping has ended: {}; the map is as it was before that", what));
}

}  // namespace

class OASLAM_LOCAL Slam::Impl {
 public:
  Impl(const SlamConfig& config, const Camera& camera)
      : config_(config), camera_(camera), frame_maker_(config, camera), relocalizer_(config) {
    Map map;
    map.cameras.push_back(camera);
    Begin(std::move(map), false);
  }
  ~Impl() { states_->Close(); }

  // Begins with another map, for which time stamps begin anew; the settings stay. Throws before
  // anything is changed.
  void Begin(Map map, bool is_loaded, std::vector<Piece> others = {}) {
    const auto known = std::ranges::find(map.cameras, camera_);
    const auto camera_index = static_cast<int>(known - map.cameras.begin());
    if (known == map.cameras.end()) map.cameras.push_back(camera_);
    auto atlas = std::make_unique<Atlas>(config_, std::move(map), is_loaded, std::move(others));
    atlas->SetRelocalizationMode(mode_);
    atlas->SetMapping(is_mapping_);
    if (is_shut_down_) atlas->Shutdown();
    atlas_ = std::move(atlas);
    camera_index_ = camera_index;
    audit_ = {};
    trails_ = {};
    last_timestamp_.reset();
    has_told_failure_ = false;
  }

  void Begin(SavedMap saved) {
    const int frames = FramesOf(saved);
    Begin(std::move(saved.map), true, std::move(saved.pieces));
    first_index_ = next_index_ = frames;
    loaded_trajectory_ = std::move(saved.trajectory);
    class_names_ = std::make_shared<const ClassNames>(std::move(saved.class_names));
  }

  void Reset() {
    Map map;
    map.cameras.push_back(camera_);
    map.classes = session().snapshot()->classes;
    Begin(std::move(map), false);
    loaded_trajectory_.clear();
    first_index_ = next_index_ = 0;
  }

  // Throws if mapping has ended, for functions that would change the map.
  void ExpectMapping() {
    const std::exception_ptr failure = atlas_->failure();
    if (!failure) return;
    has_told_failure_ = true;
    throw ErrorOf(failure);
  }

  void CheckTimestamp(double timestamp) const {
    if (!std::isfinite(timestamp)) throw InputError("time stamp is not finite");
    if (last_timestamp_ && !(timestamp > *last_timestamp_))
      throw InputError(fmt::format("time stamp {:.6f} is not after the one before, {:.6f}",
                                   timestamp, *last_timestamp_));
  }

  TrackingResult Process(const ImageInput& input);
  Session& session() { return atlas_->main(); }
  const Session& session() const { return atlas_->main(); }
  RelocalizationResult Find(const Frame& frame, RelocalizationMode mode,
                            const std::optional<Eigen::Vector3d>& gravity_in_cam,
                            double ms_features, ObjectTrails* trails = nullptr,
                            const std::optional<Rigid3>& prior = std::nullopt);
  MapSnapshot Snapshot() const { return SnapshotMaker::Of(session().snapshot(), class_names_); }

  void SetAnchors(std::map<std::string, Anchor> anchors) {
    ExpectMapping();
    MapCommand command;
    command.frame_index = next_index_;
    command.anchors = std::move(anchors);
    session().SubmitAndWait(std::move(command));
  }

  Frame MakeFrame(const ImageInput& input, int index, int keypoints) {
    Frame frame = frame_maker_.Make(input, index, keypoints, session().snapshot()->classes);
    frame.camera = camera_index_;
    return frame;
  }

  SlamConfig config_;
  Camera camera_;
  int camera_index_ = 0;
  FrameMaker frame_maker_;
  Relocalizer relocalizer_;
  std::unique_ptr<Atlas> atlas_;
  std::vector<FramePose> loaded_trajectory_;
  std::shared_ptr<const ClassNames> class_names_ =
      std::make_shared<const ClassNames>(CocoClassNames());
  std::shared_ptr<SlamStates::Board> states_ = std::make_shared<SlamStates::Board>();
  RelocalizationMode mode_ = RelocalizationMode::kPointsAndObjects;
  bool is_mapping_ = true, is_shut_down_ = false;
  // Whether the reason why mapping has ended was thrown already.
  bool has_told_failure_ = false;
  ObjectAudit audit_;
  int first_index_ = 0, next_index_ = 0;  // frames of a loaded map have smaller indices
  ObjectTrails trails_;                   // of FollowByObjects
  std::optional<double> last_timestamp_;
};

TrackingResult Slam::Impl::Process(const ImageInput& input) {
  ExpectMapping();
  CheckTimestamp(input.timestamp);
  const Stopwatch total;
  const int keypoints = config_.features.count * (atlas_->IsInitializing() ? 2 : 1);
  const Frame frame = MakeFrame(input, next_index_, keypoints);
  last_timestamp_ = input.timestamp;
  ++next_index_;
  const double ms_features = total.WallMs(), cpu_features = total.ThreadCpuMs();

  const Stopwatch tracking;
  const Tracker::Outcome outcome = atlas_->Process(frame);
  const double ms_track = tracking.WallMs(), cpu_track = tracking.ThreadCpuMs();
  if (outcome.cam_from_world && !session().tracker().IsMapping())
    audit_.Add(frame, *outcome.cam_from_world, *session().snapshot(), config_.objects);

  TrackingResult result;
  result.frame = frame.index - first_index_;
  result.timestamp = frame.timestamp;
  result.state = outcome.state;
  if (outcome.cam_from_world) result.world_from_cam = outcome.cam_from_world->Inverse();
  result.keypoints = frame.features->size();
  result.matched = outcome.matched;
  result.inliers = outcome.inliers;
  result.objects = outcome.objects;
  result.confidence = outcome.confidence;
  result.depth = outcome.depth;
  result.piece = atlas_->main_number();
  result.ms_objects = outcome.ms_objects;
  result.detections = static_cast<int>(input.detections.size());
  result.ms_features = ms_features;
  result.ms_track = ms_track;
  result.ms_total = ms_features + ms_track;
  result.cpu_ms = cpu_features + cpu_track;
  states_->Post(std::make_shared<const SlamState>(SlamState{result, Snapshot()}));
  return result;
}

RelocalizationResult Slam::Impl::Find(const Frame& frame, RelocalizationMode mode,
                                      const std::optional<Eigen::Vector3d>& gravity_in_cam,
                                      double ms_features, ObjectTrails* trails,
                                      const std::optional<Rigid3>& prior) {
  // A fresh random generator for each image: no answer depends on the random numbers before.
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const Stopwatch watch;
  const Relocalization found =
      relocalizer_.Find(frame, *session().snapshot(), mode, gravity_in_cam, rng, trails, prior);
  RelocalizationResult result = ResultOf(found);
  result.ms_features = ms_features;
  result.ms = watch.WallMs();
  if (result.world_from_cam)
    audit_.Add(frame, found.cam_from_world, *session().snapshot(), config_.objects);
  return result;
}

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
  frame += impl_->first_index_;
  const std::vector<ObjectDetection> ideal = CheckedDetections(impl_->camera_, detections);
  const std::optional<Tracker::Outcome> outcome = impl_->atlas_->AddDetections(frame, ideal);
  return outcome && outcome->cam_from_world ? std::optional(outcome->objects) : std::nullopt;
}

void Slam::SetRelocalizationMode(RelocalizationMode mode) {
  impl_->mode_ = mode;
  impl_->atlas_->SetRelocalizationMode(mode);
}

RelocalizationResult Slam::Relocalize(const ImageInput& input, RelocalizationMode mode,
                                      const std::optional<Rigid3>& prior) {
  CheckPose(prior);
  const Stopwatch watch;
  const Frame frame = impl_->MakeFrame(input, 0, impl_->config_.features.count);
  return impl_->Find(frame, mode, frame.gravity_in_cam, watch.WallMs(), nullptr, prior);
}

RelocalizationResult Slam::RelocalizeWithUnknownCamera(const ImageInput& input,
                                                       RelocalizationMode mode) {
  CheckGravity(input.gravity_in_cam);
  return FindWithUnknownCamera(input, impl_->camera_, *impl_->session().snapshot(), mode,
                               impl_->config_, impl_->frame_maker_, impl_->relocalizer_);
}

RelocalizationResult Slam::RelocalizeByObjects(
    const std::vector<Detection>& detections,
    const std::optional<Eigen::Vector3d>& gravity_in_cam) {
  CheckGravity(gravity_in_cam);
  const Frame frame{
      0, 0, impl_->camera_index_, {}, CheckedDetections(impl_->camera_, detections), false};
  return impl_->Find(frame, RelocalizationMode::kObjects, gravity_in_cam, 0);
}

RelocalizationResult Slam::FollowByObjects(double timestamp,
                                           const std::vector<Detection>& detections,
                                           const std::optional<Eigen::Vector3d>& gravity_in_cam) {
  CheckGravity(gravity_in_cam);
  impl_->CheckTimestamp(timestamp);
  const Frame frame{
      0, timestamp, impl_->camera_index_, {}, CheckedDetections(impl_->camera_, detections), false};
  impl_->last_timestamp_ = timestamp;
  return impl_->Find(frame, RelocalizationMode::kObjects, gravity_in_cam, 0, &impl_->trails_);
}

void Slam::SetMapping(bool enabled) {
  impl_->is_mapping_ = enabled;
  impl_->atlas_->SetMapping(enabled);
}

void Slam::ForceRelocalization(const std::optional<Rigid3>& near) {
  CheckPose(near);
  impl_->atlas_->ForceRelocalization(near);
  impl_->trails_ = {};
}

FrameView SlamAccess::View(const Slam& slam) {
  const Session& session = slam.impl_->atlas_->main();
  FrameView view = session.tracker().View();
  view.map = session.snapshot();
  return view;
}

void Slam::SetClassNames(std::map<int, std::string> names) {
  impl_->class_names_ = std::make_shared<const ClassNames>(std::move(names));
}

void Slam::SetClassRelations(const ClassRelations& relations) {
  if (const auto part = PartOfItself(relations.whole_of))
    throw InputError(fmt::format("class {} is a part of itself", *part));
  impl_->ExpectMapping();
  impl_->atlas_->SetClassRelations(relations);
}

std::vector<AnchorPose> Slam::Anchors() const { return PosesOf(*impl_->session().snapshot()); }

// These functions edit the newest map, not the tracker's snapshot: commands that are still queued
// may change the scale of the map.
AnchorReport Slam::PlaceAnchor(const AnchorRequest& request) {
  const std::shared_ptr<const Map> map = impl_->session().Newest();
  std::map<std::string, Anchor> anchors = map->anchors;
  AnchorReport report = oaslam::PlaceAnchor(*map, request, anchors);
  if (!report.name.empty()) impl_->SetAnchors(std::move(anchors));
  return report;
}

std::string Slam::EditAnchor(const std::string& name, const AnchorEdit& edit) {
  const std::shared_ptr<const Map> map = impl_->session().Newest();
  std::map<std::string, Anchor> anchors = map->anchors;
  std::string problem = oaslam::EditAnchor(*map, name, edit, anchors);
  if (problem.empty()) impl_->SetAnchors(std::move(anchors));
  return problem;
}

bool Slam::RemoveAnchor(const std::string& name) {
  std::map<std::string, Anchor> anchors = impl_->session().Newest()->anchors;
  if (anchors.erase(name) == 0) return false;
  impl_->SetAnchors(std::move(anchors));
  return true;
}

std::vector<ObjectPresence> Slam::Presence() const { return impl_->audit_.Report(); }

void Slam::Finish() {
  const std::string why_no_map = impl_->session().tracker().why_no_map();
  impl_->atlas_->Finish();
  if (impl_->session().snapshot()->keyframes.empty() && !why_no_map.empty())
    Log(LogLevel::kWarning,
        fmt::format("no map was made: {}; it takes a camera that moves sideways past things with "
                    "texture, neither too fast nor too dark",
                    why_no_map));
  if (!impl_->has_told_failure_) impl_->ExpectMapping();
}

void Slam::SetMetresPerUnit(double metres) {
  if (!(std::isfinite(metres) && metres > 0))
    throw InputError(fmt::format("metres per unit: {}, allowed: above 0 and finite", metres));
  impl_->ExpectMapping();
  impl_->atlas_->SetMetresPerUnit(metres);
  for (FramePose& pose : impl_->loaded_trajectory_) pose.cam_from_reference.translation *= metres;
  impl_->trails_ = {};
  impl_->ExpectMapping();
}

std::vector<StampedPose> Slam::Trajectory() const {
  std::vector<StampedPose> poses;
  for (const FramePose& frame : impl_->session().tracker().trajectory())
    if (const auto reference = frame.frame_index < impl_->first_index_
                                   ? std::nullopt
                                   : impl_->session().snapshot()->ResolvePose(frame.reference))
      poses.push_back({frame.timestamp, (frame.cam_from_reference * *reference).Inverse()});
  return poses;
}

SavedMap SlamAccess::Export(const Slam& slam) {
  const Slam::Impl& impl = *slam.impl_;
  SavedMap saved{*impl.session().snapshot(), impl.loaded_trajectory_, *impl.class_names_,
                 impl.atlas_->Others()};
  AdoptPoses(impl.session().tracker().trajectory(), 1, saved.trajectory);
  return saved;
}

int Slam::MainPiece() const { return impl_->atlas_->main_number(); }

void Slam::Save(const std::string& path) const { SaveMap(path, SlamAccess::Export(*this)); }

void Slam::Load(const std::string& path, int piece) {
  SavedMap saved = LoadMap(path);
  LeadWithPiece(path, piece, saved);
  impl_->Begin(std::move(saved));
}

void SlamAccess::Load(Slam& slam, const IndexedMap& map) {
  slam.impl_->Begin(*map.saved);  // shares its tables
  slam.impl_->session().tracker().Use(map.index);
  slam.impl_->relocalizer_.Use(map.index);
}

void Slam::Reset() { impl_->Reset(); }

void Slam::Shutdown() {
  impl_->is_shut_down_ = true;
  impl_->atlas_->Shutdown();
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
      point.landmark = view.landmarks[i].value;
      point.position = landmark->position;
    }
    points.push_back(point);
  }
  return points;
}

}  // namespace oaslam
