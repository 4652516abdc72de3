// Slam's map: its worlds, the states that other threads read, its anchors and its unit. What Slam
// does with an image is in slam_images.cc.
#include "oaslam/system/slam_impl.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "oaslam/map/metre.h"
#include "oaslam/map/scale_drift.h"
#include "oaslam/util/bad_input.h"

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
