// Continues the tracker where its map was joined with another, or scaled.
#include <utility>

#include "oaslam/system/tracker.h"

namespace oaslam {

void Tracker::GoOnAs(Tracker other, double scale) {
  phase_ = other.phase_;
  last_ = std::move(other.last_);
  if (last_) last_->cam_from_reference.translation *= scale;
  newest_ = std::move(other.newest_);
  anchors_ = std::move(other.anchors_);
  for (OdometryAnchor& anchor : anchors_) anchor.cam_from_reference.translation *= scale;
  unit_ = other.unit_;
  registration_ = {};
  keyframe_motions_ = std::move(other.keyframe_motions_);
  if (unit_) unit_->length *= scale;
  map_began_time_ = other.map_began_time_;
  seen_in_map_time_ = other.seen_in_map_time_;
  depth_ = scale * other.depth_;
  view_has_changed_ = other.view_has_changed_;
  newest_keyframe_ = other.newest_keyframe_;
  newest_keyframe_frame_ = other.newest_keyframe_frame_;
  newest_keyframe_time_ = other.newest_keyframe_time_;
  newest_keyframe_inliers_ = other.newest_keyframe_inliers_;
  relocalized_frame_ = other.relocalized_frame_;
  relocalized_time_ = other.relocalized_time_;
  usual_spread_ = other.usual_spread_;
  drift_ = {};
  seen_confidence_ = other.seen_confidence_;
  uses_ = std::move(other.uses_);
  lost_images_.clear();
  next_keyframe_ = other.next_keyframe_;
  object_tracks_ = std::move(other.object_tracks_);
  for (ObjectTrack& track : object_tracks_.open) track.cam_from_reference.translation *= scale;
  undetected_ = std::move(other.undetected_);
  for (Undetected& undetected : undetected_)
    undetected.tracked.cam_from_reference.translation *= scale;
  for (ObjectSighting& sighting : other.sightings_) {
    sighting.observation.cam_from_reference.translation *= scale;
    sightings_.push_back(std::move(sighting));
  }
  trajectory_.Join(std::move(other.trajectory_), scale);
}

void Tracker::Scale(double factor) {
  if (last_) last_->cam_from_reference.translation *= factor;
  if (prior_) prior_->translation *= factor;
  for (OdometryAnchor& anchor : anchors_) anchor.cam_from_reference.translation *= factor;
  if (unit_) unit_->length *= factor;
  depth_ *= factor;
  registration_ = {};
  object_trails_ = {};
  for (ObjectTrack& track : object_tracks_.open) track.cam_from_reference.translation *= factor;
  for (Undetected& undetected : undetected_)
    undetected.tracked.cam_from_reference.translation *= factor;
  for (ObjectSighting& sighting : sightings_)
    sighting.observation.cam_from_reference.translation *= factor;
  trajectory_.Scale(factor);
}

}  // namespace oaslam
