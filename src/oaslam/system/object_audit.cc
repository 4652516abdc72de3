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
    Audited& audited = audited_[sighting.object];
    audited.category_id = object.category_id;
    ++audited.expected;
    audited.seen += sighting.place == PlaceEvidence::kInPlace;
    audited.absence += AbsenceEvidence(sighting.place, interval, object);
  }
}

std::vector<ObjectPresence> ObjectAudit::Report() const {
  std::vector<ObjectPresence> report;
  for (const auto& [id, audited] : audited_)
    report.push_back({id.value, audited.category_id, audited.expected, audited.seen,
                      IsProvenAbsent(audited.absence)});
  return report;
}

}  // namespace oaslam
