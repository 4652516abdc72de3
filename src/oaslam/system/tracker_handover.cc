// Continues the tracker where its map was joined with another, or scaled.
#include <utility>

#include "oaslam/system/tracker.h"

namespace oaslam {

void Tracker::GoOnAs(Tracker other, double scale) {
  other.Scale(scale);
  // These belong to this map.
  trajectory_.Join(std::move(other.trajectory_));
  other.trajectory_ = std::move(trajectory_);
  other.sightings_.insert(other.sightings_.begin(), sightings_.begin(), sightings_.end());
  other.relocalizer_ = std::move(relocalizer_);
  other.relocalization_ = relocalization_;
  other.rng_ = rng_;
  other.map_is_loaded_ = map_is_loaded_;
  other.lost_images_.clear();
  other.drift_ = {};
  *this = std::move(other);
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
