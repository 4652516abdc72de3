#include "oaslam/map_editing.h"

#include <utility>

#include "oaslam/objects/object_edit.h"
#include "oaslam/relocalization/image_search.h"
#include "oaslam/relocalization/snapshot_content.h"
#include "oaslam/system/map_merging.h"

namespace oaslam {

MapSnapshot EditObject(const MapSnapshot& map, ObjectId object, const ObjectEdit& edit,
                       const SlamConfig& config) {
  CheckConfig(config);
  SavedMap saved = SavedMapOf(map);
  EditObject(saved.map, object, edit, config.objects);
  return SnapshotOf(std::move(saved), map.world(), map.version() + 1);
}

MergedMaps MergeMaps(const MapSnapshot& first, const MapSnapshot& second, RelocalizationMode mode,
                     const SlamConfig& config) {
  CheckConfig(config);
  CheckMode(mode);
  MapMerging merging = MergeMaps(SavedMapOf(first), SavedMapOf(second), mode, config);
  MergedMaps merged{{}, std::move(merging.evidence)};
  if (merging.merged) merged.map = SnapshotOf(*std::move(merging.merged), NewWorld(), 1);
  return merged;
}

}  // namespace oaslam
