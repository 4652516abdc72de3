#include "oaslam/system/object_audit.h"

#include "oaslam/objects/association.h"
#include "oaslam/objects/presence.h"

namespace oaslam {

void ObjectAudit::Add(const Frame& frame, const Rigid3& cam_from_world, const Map& map,
                      const ObjectsConfig& config) {
  // Single images have no ascending time stamps; each counts as much as an image of a video.
  const bool follows = last_time_ && frame.timestamp > *last_time_;
  const double interval = follows ? frame.timestamp - *last_time_ : kVideoInterval;
  last_time_ = frame.timestamp;
  TrackedFrame tracked;
  tracked.frame = frame;
  tracked.cam_from_world = cam_from_world;
  for (const ObjectSighting& sighting :
       AssociateObjects(tracked, map, ObjectTracks::ContinueFrom(map), config).sightings) {
    if (sighting.place == PlaceEvidence::kNone) continue;
    const Object& object = map.objects.At(sighting.object);
    auto& [presence, absence] = audited_[sighting.object];
    absence += AbsenceEvidence(sighting.place, interval, object);
    presence = {sighting.object, object.category_id, presence.expected + 1,
                presence.seen + (sighting.place == PlaceEvidence::kInPlace),
                IsProvenAbsent(absence)};
  }
}

std::vector<ObjectPresence> ObjectAudit::Report() const {
  std::vector<ObjectPresence> report;
  for (const auto& [id, audited] : audited_) report.push_back(audited.presence);
  return report;
}

}  // namespace oaslam
