#include "oaslam/system/slam_impl.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <future>
#include <utility>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/metre.h"
#include "oaslam/map/scale_drift.h"
#include "oaslam/relocalization/given_input.h"
#include "oaslam/relocalization/image_search.h"
#include "oaslam/util/bad_input.h"
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

void CheckTimestamp(double timestamp, const std::optional<double>& last) {
  if (!std::isfinite(timestamp)) throw InputError("time stamp is not finite");
  if (last && !(timestamp > *last))
    throw BadInput("time stamp {:.6f} is not after the one before, {:.6f}", timestamp, *last);
}

void TakePose(const ImagePose& pose, TrackingResult& result) {
  const bool looked = result.keypoints > 0;  // for landmarks
  result.state = pose.state;
  result.source = pose.source;
  result.SetPose(pose.cam_from_world ? std::optional(pose.cam_from_world->Inverse())
                                     : std::nullopt);
  result.matched = looked ? std::optional(pose.matched) : std::nullopt;
  result.inliers = looked ? std::optional(pose.inliers) : std::nullopt;
  result.objects = pose.objects;
  result.confidence = pose.confidence;
  result.covariance = pose.covariance;
  result.is_uncertain = pose.is_uncertain;
  result.seconds_without_map = pose.seconds_without_map;
  result.depth = pose.depth;
}

}  // namespace

Slam::Impl::Impl(const SlamConfig& config, const Camera& camera)
    : config_(config),
      camera_(camera),
      frame_maker_(config, camera),
      relocalizer_(config),
      lens_(camera) {
  Begin({}, NewWorld(), false);
}

void Slam::Impl::Begin(SavedMap saved, WorldId world, bool is_loaded) {
  const int frames = FramesOf(saved);
  Map& map = saved.map;
  map.AddCamera(camera_);
  ForgetScaleDrift(map);
  for (Submap& submap : saved.submaps) ForgetScaleDrift(submap.map);
  auto atlas =
      std::make_unique<Atlas>(config_, std::move(map), is_loaded, std::move(saved.submaps));
  atlas->SetRelocalizationMode(mode_);
  atlas->SetMapping(is_mapping_);
  atlas_ = std::move(atlas);
  worlds_ = {{atlas_->main_number(), world}};
  former_worlds_.clear();
  told_begun_ = -1;
  told_joined_.clear();
  // The error of a guess would look like a change of the lens.
  odometry_.emplace(camera_, OdometryOptions{.watches_lens = !camera_.is_guess},
                    static_cast<uint64_t>(config_.runner.seed));
  lens_ = PresentLens(camera_);
  frame_maker_.UseFocalRatio(1, 0);
  repeated_images_ = {};
  repeated_s_ = 0;
  is_repeating_ = false;
  if (still_parts_) {  // what was found is of the images so far, whose times may begin again
    still_parts_.emplace();
    mask_ = {};
    frame_maker_.SetMask(mask_);
  }
  odometry_->SetMask(mask_);
  odometry_->SetImu(cam_from_imu_);
  audit_ = {};
  trails_ = {};
  last_timestamp_.reset();
  last_followed_.reset();
  has_told_failure_ = false;
  newest_ = {};
  newest_.frame = -1;
  newest_.world = world;
  newest_.state = is_loaded ? TrackingState::kLost : TrackingState::kInitializing;
  first_index_ = next_index_ = frames;
  loaded_trajectory_ = std::move(saved.trajectory);
  loaded_recordings_ = std::move(saved.recordings);
  recording_.first_frame = frames;
  if (is_loaded) class_names_ = std::make_shared<const ClassNames>(std::move(saved.class_names));
  Post();
}

WorldId Slam::Impl::WorldOf(int submap) const {
  const auto [entry, is_new] = worlds_.try_emplace(submap);
  if (is_new) entry->second = NewWorld();
  return entry->second;
}

std::vector<PoseElsewhere> Slam::Impl::PosesElsewhere(const TrackingResult& result) const {
  std::vector<PoseElsewhere> poses;
  const std::optional<Rigid3> here = result.PoseIn(result.world);
  for (const auto& [number, main_from_joined] : atlas_->Joined()) {
    const auto world = worlds_.find(number);
    if (!here || world == worlds_.end()) continue;  // nobody was told of it
    PoseElsewhere& there =
        poses.emplace_back(PoseElsewhere{world->second, result.state, *here, result.covariance,
                                         result.is_uncertain, result.confidence, result.depth});
    there.ScaleLengths(1 / main_from_joined.scale);
    there.world_from_cam = (Similarity(here->Inverse()) * main_from_joined).AsPose().Inverse();
  }
  if (const auto growing = atlas_->PoseInGrowing()) {
    const auto& [number, pose] = *growing;
    poses.push_back({WorldOf(number), pose.state, pose.cam_from_world->Inverse(), pose.covariance,
                     pose.is_uncertain, pose.confidence, pose.depth});
  }
  return poses;
}

void Slam::Impl::SetMask(const ImageMask& mask) {
  mask_ = mask;
  frame_maker_.SetMask(mask);
  odometry_->SetMask(mask);
}

void Slam::Impl::SetImu(const Rigid3& cam_from_imu) {
  constexpr double kMost = 10;  // m
  if (!cam_from_imu.IsValid() || cam_from_imu.translation.norm() > kMost)
    throw BadInput("T_cam_imu: must be a rigid motion of at most {} m", kMost);
  cam_from_imu_ = cam_from_imu;
  odometry_->SetImu(cam_from_imu_);
}

void Slam::Impl::ExpectMapping() {
  const std::exception_ptr failure = atlas_->failure();
  if (!failure) return;
  has_told_failure_ = true;
  throw ErrorOf(failure);
}

// The submaps that began, and those that were joined with the main one, since the last call.
ChangesBetweenStates Slam::Impl::NewInSubmaps() {
  ChangesBetweenStates changes;
  const auto growing = atlas_->PoseInGrowing();
  if (growing && growing->first > told_begun_) {
    told_begun_ = growing->first;
    changes.begun.push_back(WorldOf(told_begun_));
  }
  for (const auto& [number, main_from_joined] : atlas_->Joined()) {
    const auto world = worlds_.find(number);
    if (told_joined_.insert(number).second)
      changes.joined.push_back(world == worlds_.end() ? WorldId() : world->second);
  }
  return changes;
}

void Slam::Impl::Post(const std::string& edited_anchor) {
  ChangesBetweenStates changes = NewInSubmaps();
  changes.edited_anchor = edited_anchor;
  states_->Post(std::make_shared<const SlamState>(SlamState{newest_, Snapshot()}), changes);
}

void Slam::Impl::PostChange(const std::string& edited_anchor) {
  const WorldId now = world();
  const int index = first_index_ + newest_.frame;
  const Tracker& tracker = session().tracker();
  std::optional<Rigid3> cam_from_world;
  if (newest_.frame >= 0) cam_from_world = tracker.PoseOf(index, *session().snapshot());
  const auto there = std::ranges::find(newest_.elsewhere, now, &PoseElsewhere::world);
  if (now != newest_.world && there != newest_.elsewhere.end())
    newest_.GoTo(*there);  // the submap that grew has become the main one
  if (cam_from_world) {
    if (!newest_.HasPose()) {
      const bool is_tracked = tracker.HasTracked(index);
      newest_.state = is_tracked ? TrackingState::kTracking : TrackingState::kObjects;
      newest_.source = is_tracked ? PoseSource::kMap : PoseSource::kRegistration;
    }
    newest_.SetPose(cam_from_world->Inverse());
  } else if (now != newest_.world && newest_.HasPose()) {
    TakePose({}, newest_);
  }
  newest_.world = now;
  newest_.elsewhere = PosesElsewhere(newest_);
  Post(edited_anchor);
}

Frame Slam::Impl::MakeFrame(const ImageInput& input, int index, int keypoints) {
  return frame_maker_.Make(input, index, keypoints, session().snapshot()->classes);
}

Frame Slam::Impl::FrameOfBoxes(const ImageInput& input, double timestamp) const {
  return {0,
          timestamp,
          frame_maker_.camera(),
          {},
          CheckedDetections(*frame_maker_.camera(), input.detections),
          false,
          input.gravity_in_cam};
}

// How the camera moved, as its images tell it; null where this one tells nothing. Adds the CPU
// time.
std::shared_ptr<const FrameMotion> Slam::Impl::RunOdometry(
    const ImageInput& grey, const std::shared_ptr<const DepthMap>& depth, double& cpu_ms) {
  const Stopwatch watch;
  OdometryEstimate estimate = odometry_->Process(ViewOf(grey.image), grey.timestamp,
                                                 {grey.angular_velocity, grey.imu, depth});
  lens_.See(estimate, odometry_->FollowsLens(), grey.timestamp);
  std::shared_ptr<FrameMotion> motion;
  if (estimate.state == OdometryState::kPreliminary || estimate.state == OdometryState::kTracking ||
      estimate.state == OdometryState::kInertial) {
    motion = std::make_shared<FrameMotion>();
    motion->run = estimate.run;
    motion->image = estimate.image;
    motion->keyframes = std::move(estimate.keyframes);
    motion->cam_from_odom = estimate.cam_from_odom;
    motion->is_preliminary = estimate.state == OdometryState::kPreliminary;
    motion->is_keyframe = estimate.is_keyframe;
    motion->exchanged_since = estimate.exchanged_since;
    motion->scale_drift = estimate.scale_drift;
    motion->agreeing = estimate.inliers / std::max(1.0, static_cast<double>(estimate.tracked));
    if (estimate.metres_per_unit > 0)
      motion->metre =
          MeasuredMetre{estimate.metres_per_unit, estimate.metre_sigma,
                        estimate.metre_is_by_depth ? UnitSource::kDepth : UnitSource::kImu};
    motion->gravity_in_cam = estimate.gravity_in_cam;
    const Camera camera = Zoomed(camera_, lens_.ratio());
    for (const OdometryDepth& d : odometry_->Depths())
      motion->depths.push_back({ProjectIdeal(camera, d.ray.homogeneous()).cast<float>(),
                                static_cast<float>(d.inverse_depth)});
  }
  cpu_ms += watch.ThreadCpuMs();
  return motion;
}

// Features and motion are found side by side, where it is known beforehand that both are needed.
Frame Slam::Impl::MakeNextFrame(const ImageInput& input, double& cpu_ms) {
  frame_maker_.Check(input);
  const Stopwatch watch;
  ImageInput grey = input;
  const bool has_image = !input.image.empty();
  if (has_image) grey.image = ToGrey(input.image);
  const std::shared_ptr<const DepthMap> depth =
      input.depth ? depth_registration_.Register(*input.depth, camera_) : nullptr;
  repeated_s_ = has_image ? repeated_images_.Add(grey.image, input.timestamp) : 0;
  if (has_image && still_parts_ && still_parts_->Add(ViewOf(grey.image), input.timestamp)) {
    SetMask(still_parts_->mask());
    Log(LogLevel::kWarning,
        "a part of the images moves with the camera, and is left out from now on: {}",
        Describe(mask_));
  }
  EraseHidden(mask_, {camera_.width, camera_.height}, grey.detections);
  const auto with_features = [&] {
    return MakeFrame(grey, next_index_,
                     config_.features.count * (atlas_->IsInitializing() ? 2 : 1));
  };
  double motion_cpu_ms = 0;
  const auto follow = [&]() -> std::shared_ptr<const FrameMotion> {
    if (input.motion) {
      lens_.LookAway();
      return MotionOf(*input.motion, camera_);
    }
    return has_image ? RunOdometry(grey, depth, motion_cpu_ms) : nullptr;
  };
  Frame frame;
  if (atlas_->NeedsFeatures(input.timestamp, nullptr) && !odometry_->FollowsLens()) {
    auto motion = std::async(std::launch::async, follow);
    frame = with_features();
    frame.motion = motion.get();
    if (frame_maker_.UseFocalRatio(lens_.ratio(), lens_.sigma())) {
      const auto known = std::move(frame.motion);
      frame = with_features();
      frame.motion = known;
    }
    cpu_ms = watch.ThreadCpuMs() + motion_cpu_ms;
  } else {
    const std::shared_ptr<const FrameMotion> motion = follow();
    frame_maker_.UseFocalRatio(lens_.ratio(), lens_.sigma());
    frame = !motion || atlas_->NeedsFeatures(input.timestamp, motion.get())
                ? with_features()
                : frame_maker_.MakeWithoutFeatures(grey, next_index_);
    frame.motion = motion;
    cpu_ms = watch.ThreadCpuMs();
  }
  if (!odometry_->RefusesDepth()) frame.depth = depth;
  return frame;
}

// What an image shows that the camera has given before says nothing of where the camera is now.
void Slam::Impl::DoubtRepeated(TrackingResult& result) {
  // A video may repeat an image or two, where its rate was changed.
  constexpr double kSeconds = 0.2;
  constexpr double kEven = 0.5;  // whether the camera has stayed since is not known
  const bool was_repeating =
      std::exchange(is_repeating_, repeated_s_ >= kSeconds && result.HasPose());
  if (!is_repeating_) return;
  if (!was_repeating)
    Log(LogLevel::kWarning, "the camera has given the same image since {:.2f} s",
        result.timestamp - repeated_s_);
  result.is_uncertain = true;
  result.confidence = std::min(result.confidence, kEven);
}

TrackingResult Slam::Impl::Process(const ImageInput& input) {
  ExpectMapping();
  CheckTimestamp(input.timestamp, last_timestamp_);
  const Stopwatch total;
  double cpu_features = 0;
  Frame frame = MakeNextFrame(input, cpu_features);
  if (!camera_.is_guess && lens_.IsReplaced(frame, session().snapshot(), config_, relocalizer_)) {
    odometry_->ReplaceLens(lens_.ratio());
    frame_maker_.UseFocalRatio(lens_.ratio(), lens_.sigma());
    ImageInput again = input;
    EraseHidden(mask_, {camera_.width, camera_.height}, again.detections);
    frame = MakeFrame(again, next_index_, config_.features.count);
  }
  if (frame.motion && !frame.gravity_in_cam) frame.gravity_in_cam = frame.motion->gravity_in_cam;
  last_timestamp_ = input.timestamp;
  ++next_index_;
  const double ms_features = total.WallMs();

  const Stopwatch tracking;
  const TrackingStep step = atlas_->Process(frame);
  const double ms_track = tracking.WallMs(), cpu_track = tracking.ThreadCpuMs();
  if (step.pose.cam_from_world && !is_mapping_)
    audit_.Add(frame, *step.pose.cam_from_world, *session().snapshot(), config_.objects);

  TrackingResult result;
  result.frame = frame.index - first_index_;
  result.timestamp = frame.timestamp;
  result.world = world();
  result.keypoints = frame.features_skipped ? 0 : frame.features->size();
  TakePose(step.pose, result);
  result.focal_ratio = lens_.ratio();
  if (result.HasPose() && lens_.IsUncertain()) result.is_uncertain = true;
  DoubtRepeated(result);
  result.elsewhere = PosesElsewhere(result);
  if (result.HasPose()) result.motion_unit = session().tracker().MotionUnit(frame);
  result.ms_objects = step.ms_objects;
  result.detections = static_cast<int>(input.detections.size());
  result.ms_features = ms_features;
  result.ms_track = ms_track;
  result.ms_total = ms_features + ms_track;
  result.cpu_ms = cpu_features + cpu_track;
  newest_ = result;
  Post();
  TakeMetre();
  TakeSensorsMetre(false);
  return newest_;
}

std::optional<int> Slam::Impl::AddDetections(int frame, const std::vector<Detection>& given) {
  std::vector<Detection> detections = given;
  EraseHidden(mask_, {camera_.width, camera_.height}, detections);
  const std::vector<ObjectDetection> ideal = CheckedDetections(*frame_maker_.camera(), detections);
  const std::optional<TrackingStep> step = atlas_->AddDetections(frame + first_index_, ideal);
  if (!step || !step->pose.cam_from_world) return std::nullopt;
  if (frame == newest_.frame) {
    newest_.detections = static_cast<int>(detections.size());
    newest_.objects = step->pose.objects;
    if (!newest_.HasPose()) TakePose(step->pose, newest_);
    newest_.elsewhere = PosesElsewhere(newest_);
    Post();
  }
  return step->pose.objects;
}

RelocalizationResult Slam::Impl::Find(const Frame& frame, const RelocalizeOptions& options,
                                      double ms_features) {
  // A fresh random generator for each image: no answer depends on the random numbers before.
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const Stopwatch watch;
  const RelocalizationMode mode = frame.features ? options.mode : RelocalizationMode::kObjects;
  const Relocalization found = relocalizer_.Find(
      frame, *session().snapshot(), mode, rng, options.follow ? &trails_ : nullptr, options.prior);
  RelocalizationResult result = ResultOf(found);
  result.ms_features = ms_features;
  result.ms = watch.WallMs();
  if (result.world_from_cam)
    audit_.Add(frame, found.cam_from_world, *session().snapshot(), config_.objects);
  return result;
}

RelocalizationResult Slam::Impl::Relocalize(const ImageInput& input,
                                            const RelocalizeOptions& options) {
  if (options.unknown_camera)
    return FindWithUnknownCamera(input, *frame_maker_.camera(), options, *session().snapshot(),
                                 config_, frame_maker_, relocalizer_);
  if (options.camera && *options.camera != *frame_maker_.camera()) {
    FrameMaker maker(config_, *options.camera);
    return FindImage(input, *options.camera, options, *session().snapshot(), config_, maker,
                     relocalizer_);
  }
  if (options.follow) CheckTimestamp(input.timestamp, last_followed_);
  const Stopwatch watch;
  Frame frame = input.image.empty() && !input.features
                    ? FrameOfBoxes(input, options.follow ? input.timestamp : 0)
                    : MakeFrame(input, 0, config_.features.count);
  if (input.depth && !odometry_->RefusesDepth())
    frame.depth = depth_registration_.Register(*input.depth, *frame.camera);
  if (options.follow) last_followed_ = input.timestamp;
  return Find(frame, options, watch.WallMs());
}

bool Slam::Impl::IsInImage(const Eigen::Vector2d& pixel) const {
  return pixel.x() >= 0 && pixel.x() <= camera_.width - 1 && pixel.y() >= 0 &&
         pixel.y() <= camera_.height - 1;
}

std::string Slam::Impl::NotInImage(const Eigen::Vector2d& pixel) const {
  return fmt::format("pixel {:g}, {:g}: not in the image of {}x{} pixels", pixel.x(), pixel.y(),
                     camera_.width, camera_.height);
}

std::string Slam::Impl::SetRay(const Map& map, AnchorRequest& request) const {
  const Eigen::Vector2d& pixel = *request.pixel;
  const auto ray = IsInImage(pixel) ? frame_maker_.camera()->Lift(pixel) : std::nullopt;
  if (!ray) return NotInImage(pixel);
  std::optional<Rigid3> cam_from_world;
  if (newest_.frame >= 0)
    cam_from_world = session().tracker().PoseOf(first_index_ + newest_.frame, map);
  if (!cam_from_world) return "the newest image has no pose in the map";
  request.origin = cam_from_world->OriginInSource();
  request.direction = cam_from_world->rotation.inverse() * *ray;
  return "";
}

AnchorReport Slam::Impl::ChangeAnchors(
    const std::function<AnchorReport(const Map&, oaslam::Anchors&)>& change,
    const std::string& edited) {
  const std::shared_ptr<const Map> map = session().Newest();
  oaslam::Anchors anchors = map->anchors;
  AnchorReport report = change(*map, anchors);
  if (!report.IsDone()) return report;
  ExpectMapping();
  session().Submit(std::move(anchors));
  PostChange(edited);
  ExpectMapping();
  return report;
}

void Slam::Impl::TakeMetre() {
  if (atlas_->failure()) return;
  if (const std::optional<Metre> metre = atlas_->TakeMetre())
    SetMetresPerUnit(metre->metres_per_unit, metre->by_objects);
}

std::vector<FormerWorld> Slam::Impl::FormerWorlds() const {
  const auto former = former_worlds_.find(atlas_->main_number());
  return former == former_worlds_.end() ? std::vector<FormerWorld>() : former->second;
}

void Slam::Impl::TakeSensorsMetre(bool is_last) {
  std::optional<MeasuredMetre> metre = session().tracker().metre();
  if (!is_mapping_ || !metre || atlas_->failure()) return;
  constexpr double kMostSigma = 0.06, kMuch = 0.02, kLeastChange = 1e-3;
  const std::shared_ptr<const Map> map = session().snapshot();
  if (map->keyframes.empty() || (map->is_metric && !map->unit_evidence)) return;
  if (is_last)
    metre->metres_per_unit = MetresPerUnitByMotions(*map).value_or(metre->metres_per_unit);
  const double off = std::abs(std::log(metre->metres_per_unit));
  if (!(metre->relative_sigma <= kMostSigma)) return;
  if (map->is_metric && map->unit_evidence->source != UnitSource::kObjects) {
    // What an earlier recording told better stays.
    constexpr double kAbout = 1.2;
    const double known = map->unit_evidence->relative_sigma;
    if (metre->relative_sigma > kAbout * known) return;
    if (off < (is_last ? kLeastChange : std::max(known, kMuch))) return;
  }
  SetMetresPerUnit(metre->metres_per_unit,
                   UnitEvidence{metre->relative_sigma, 0, 0, metre->source});
}

void Slam::Impl::SetMetresPerUnit(double metres, const std::optional<UnitEvidence>& by_objects) {
  if (!(std::isfinite(metres) && metres > 0))
    throw BadInput("metres per unit: {}, allowed: above 0 and finite", metres);
  ExpectMapping();
  if (session().Newest()->keyframes.empty())
    throw InputError("metres per unit: there is no map yet that has a unit");
  atlas_->SetMetresPerUnit(metres, by_objects);
  if (!session().failure()) {
    for (FramePose& pose : loaded_trajectory_) pose.cam_from_reference.translation *= metres;
    trails_ = {};
    auto& former = former_worlds_[atlas_->main_number()];
    former.push_back({this->world(), 1});
    for (FormerWorld& there : former) there.scale *= metres;
    BeginWorld();
    newest_.ScaleLengths(metres);
    PostChange();
  }
  ExpectMapping();
}

}  // namespace oaslam
