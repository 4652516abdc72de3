#include "oaslam/mapping/mapper.h"

#include <algorithm>

#include "oaslam/bundle/bundle_adjustment.h"
#include "oaslam/mapping/keyframe_description.h"
#include "oaslam/mapping/local_mapping.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/mapping/submap_joining.h"
#include "oaslam/objects/moved_objects.h"
#include "oaslam/objects/object_edit.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/objects/upright.h"
#include "oaslam/util/log.h"

namespace oaslam {

void Mapper::Apply(const MapCommand& command) {
  bool has_moved = AdoptBackgroundBundle(command);
  CountLandmarkUse(command.uses, map_);
  has_moved |= ApplyEdit(command);
  if (has_moved) RefitMovedObjects(config_.objects, map_);
  if (!command.sightings.empty())
    UpdateObjects(map_, command.sightings,
                  {command.frame_index, command.sightings.back().timestamp}, config_.objects);
  else if (std::holds_alternative<KeyframeInsertion>(command.edit))
    UpdateUp(map_);
}

bool Mapper::ApplyEdit(const MapCommand& command) {
  if (const auto* keyframe = std::get_if<KeyframeInsertion>(&command.edit))
    return Insert(*keyframe, command.frame_index);
  if (const auto* joining = std::get_if<JoiningMap>(&command.edit))
    return Join(*joining, command.frame_index);
  if (const auto* initial = std::get_if<InitialMap>(&command.edit)) {
    if (!InsertInitialMap(*initial, map_))
      Log(LogLevel::kDebug, "initial map refused after refinement");
    unsettled_keyframes_ = undescribed_keyframes_ = map_.keyframes.Ids();
  } else if (const auto* scale = std::get_if<MetricScale>(&command.edit)) {
    map_.Scale(scale->metres_per_unit);
    map_.is_metric = true;
    map_.unit_evidence = scale->by_objects;
    if (background_bundle_ || !windows_.empty()) AdjustInBackground(command.frame_index);
  } else if (const auto* classes = std::get_if<ClassRelations>(&command.edit)) {
    SetClassRelations(*classes, map_);
  } else if (const auto* anchors = std::get_if<NewAnchors>(&command.edit)) {
    map_.anchors = *anchors;
    std::erase_if(map_.anchors,
                  [&](const auto& entry) { return !map_.ResolveKeyframe(entry.second.keyframe); });
  } else if (const auto* change = std::get_if<ObjectChange>(&command.edit)) {
    EditObject(map_, change->object, change->edit, config_.objects);
  }
  return false;
}

bool Mapper::Join(const JoiningMap& joining, int frame_index) {
  const bool is_tied = JoinSubmap(*joining.map, joining.world_from_map, config_, rng_, map_);
  unsettled_keyframes_ = undescribed_keyframes_ = map_.keyframes.Ids();
  // Their age is counted in ids of keyframes, which the joined submap has taken.
  recent_landmarks_.clear();
  // A background adjustment that began before the submap came would not move its keyframes.
  const bool is_outdated = IsLive() && background_bundle_;
  if (is_tied || is_outdated) AdjustInBackground(frame_index);
  return true;
}

bool Mapper::Insert(const KeyframeInsertion& keyframe, int frame_index) {
  if (keyframe.right_until.IsValid() && keyframe.loops_closed == map_.loops_closed)
    recent_landmarks_ = CorrectMotions(keyframe.right_until, keyframe.motions, map_);
  InsertKeyframe(keyframe, map_);
  recent_landmarks_ = CullRecentLandmarks(recent_landmarks_, keyframe.id, map_);
  const std::vector<LandmarkId> created = TriangulateNewLandmarks(keyframe.id, map_);
  recent_landmarks_.insert(recent_landmarks_.end(), created.begin(), created.end());
  FuseLandmarks(keyframe.id, map_);
  if (map_.keyframes.size() > 2)
    ApplyCorrection(LocalBundleAdjustment(map_, keyframe.id, config_.bundle), map_);
  CullKeyframes(keyframe.id, map_);
  unsettled_keyframes_.push_back(keyframe.id);
  undescribed_keyframes_.push_back(keyframe.id);
  // Many keyframes are culled soon after they were inserted: those would be described in vain.
  constexpr uint32_t kYoung = 10;
  if (keyframe.id.value > kYoung) DescribeNextBefore(KeyframeId(keyframe.id.value - kYoung));
  unsettled_keyframes_ = PackSettledKeyframes(std::move(unsettled_keyframes_), map_);
  const bool has_closed = CloseLoop(keyframe.id, frame_index);
  if (!background_bundle_) BeginNextWindow(frame_index);
  return has_closed;
}

// Describes the oldest keyframe that is not described yet, if it is one before `end`.
void Mapper::DescribeNextBefore(KeyframeId end) {
  auto id = undescribed_keyframes_.begin();
  for (bool is_done = false; !is_done && id != undescribed_keyframes_.end() && *id < end; ++id)
    if (map_.keyframes.Contains(*id)) is_done = DescribeKeyframe(*id, map_);
  undescribed_keyframes_.erase(undescribed_keyframes_.begin(), id);
}

// Returns whether a loop was closed.
bool Mapper::CloseLoop(KeyframeId keyframe, int frame_index) {
  if (!config_.mapping.loop_closing) return false;
  constexpr uint32_t kMinKeyframesBetween = 10;  // the adjustment after a loop must settle first
  if (last_loop_.IsValid() && keyframe.value - last_loop_.value < kMinKeyframesBetween)
    return false;
  const std::optional<LoopClosure> loop = loop_detector_.Detect(map_, keyframe, rng_);
  if (!loop || !CorrectLoop(*loop, map_)) return false;
  Log(LogLevel::kInfo, "loop closed: keyframe {} is back at keyframe {}", loop->current.value,
      loop->old.value);
  last_loop_ = keyframe;
  ++map_.loops_closed;
  AdjustInBackground(frame_index);
  return true;
}

void Mapper::AdjustInBackground(int frame_index) {
  windows_ = AdjustmentWindows(map_);
  std::ranges::reverse(windows_);
  BeginNextWindow(frame_index);
}

void Mapper::BeginNextWindow(int frame_index) {
  // Stopping an adjustment takes some tenths of a second. In live mode another thread waits for it.
  if (IsLive() && background_bundle_)
    ending_ = std::jthread([bundle = std::move(background_bundle_)]() mutable { bundle.reset(); });
  background_bundle_.reset();
  if (windows_.empty()) return;
  std::vector<KeyframeId> window = std::move(windows_.back());
  windows_.pop_back();
  background_bundle_ = std::make_unique<BackgroundBundle>(map_, std::move(window), config_.bundle,
                                                          frame_index, adjust_);
}

// Applies the background bundle adjustment if it is due. Returns whether it has moved the map.
// Live: with the first keyframe after it is ready, so that nothing waits for it, and the map does
// not move while the camera is lost, since a lost camera makes no keyframes. Otherwise a fixed
// number of frames after its start, so that results are the same on every run.
bool Mapper::AdoptBackgroundBundle(const MapCommand& command) {
  constexpr int kFrames = 30;  // 1 s at 30 Hz; if the adjustment takes longer, the mapper waits
  if (!background_bundle_) return false;
  const bool is_due =
      IsLive()
          ? std::holds_alternative<KeyframeInsertion>(command.edit) && background_bundle_->IsReady()
          : std::holds_alternative<AdoptAdjustment>(command.edit) ||
                command.frame_index >= background_bundle_->begun_at() + kFrames;
  if (!is_due) return false;
  background_bundle_->WaitAndApply(map_);
  background_bundle_.reset();
  // After AdoptAdjustment the map must not move: the next window waits for the next keyframe.
  if (!std::holds_alternative<AdoptAdjustment>(command.edit)) BeginNextWindow(command.frame_index);
  return true;
}

void Mapper::Finish() {
  background_bundle_.reset();  // the adjustment below replaces it
  windows_.clear();
  DescribeKeyframes(map_);
  undescribed_keyframes_.clear();
  if (map_.keyframes.size() <= 2) return;
  AdjustAll(config_, map_);
  ReviewPlaces(config_.objects, map_);
}

std::shared_ptr<const Map> Mapper::Publish() {
  ++map_.version;
  return std::make_shared<const Map>(map_);
}

}  // namespace oaslam
