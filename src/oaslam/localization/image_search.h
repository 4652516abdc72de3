#pragma once

#include <memory>
#include <optional>

#include "oaslam/config.h"
#include "oaslam/image_input.h"
#include "oaslam/image_localizer.h"
#include "oaslam/localization/frame_maker.h"
#include "oaslam/localization/landmark_index.h"
#include "oaslam/localization/relocalizer.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// A map that does not change, with the index of its places. Copies share both.
struct IndexedMap {
  explicit IndexedMap(SavedMap content)
      : saved(std::make_shared<const SavedMap>(std::move(content))),
        index(std::make_shared<const LandmarkIndex>(saved->map)) {}
  std::shared_ptr<const SavedMap> saved;
  std::shared_ptr<const LandmarkIndex> index;
};

RelocalizationResult ResultOf(const Relocalization& found);

// Finds an image whose camera is not known. `camera`: that of `maker`, of which the size is used.
RelocalizationResult FindWithUnknownCamera(const ImageInput& input, const Camera& camera,
                                           const Map& map, RelocalizationMode mode,
                                           const SlamConfig& config, FrameMaker& maker,
                                           Relocalizer& relocalizer);

// Access to ImageLocalizer for the rooms above, which share its map, and for tests.
struct LocalizerAccess {
  static ImageLocalizer Make(const SlamConfig& config, IndexedMap map);
  static const IndexedMap& MapOf(const ImageLocalizer& localizer);
};

}  // namespace oaslam
