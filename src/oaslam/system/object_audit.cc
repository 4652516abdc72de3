#include "oaslam/system/object_audit.h"

#include "oaslam/objects/association.h"
#include "oaslam/objects/presence.h"

namespace oaslam {

void ObjectAudit::Add(const Frame& frame, const Rigid3& cam_from_world, const Map& map,
                      const ObjectsConfig& config) {
  TrackedFrame tracked;
  tracked.frame = frame;
  tracked.cam_from_world = cam_from_world;
  for (const ObjectSighting& sighting :
       AssociateObjects(tracked, map, ObjectTracks::ContinueFrom(map), config).sightings) {
    if (sighting.place == PlaceEvidence::kNone) continue;
    Audited& audited =
        audited_.try_emplace(sighting.object, Audited{map.objects.At(sighting.object)})
            .first->second;
    ++audited.expected;
    audited.seen += sighting.place == PlaceEvidence::kInPlace;
    WeighPlace(sighting.place, audited.object);
  }
}

std::vector<ObjectPresence> ObjectAudit::Report() const {
  std::vector<ObjectPresence> report;
  for (const auto& [id, audited] : audited_)
    report.push_back({id.value, audited.object.category_id, audited.expected, audited.seen,
                      IsProvenAbsent(audited.object)});
  return report;
}

}  // namespace oaslam
