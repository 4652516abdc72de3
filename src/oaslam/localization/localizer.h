#pragma once

#include <memory>
#include <optional>

#include "oaslam/config.h"
#include "oaslam/image_input.h"
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

// Slam::RelocalizeWithUnknownCamera in a map whose last camera is that of `maker`, which is
// `camera`.
RelocalizationResult FindWithUnknownCamera(const ImageInput& input, const Camera& camera,
                                           const Map& map, RelocalizationMode mode,
                                           const SlamConfig& config, FrameMaker& maker,
                                           Relocalizer& relocalizer);

// Finds single images in a map that does not change, as Slam::Relocalize does, each by itself.
// Thread-safe.
class Localizer {
 public:
  Localizer(const SlamConfig& config, IndexedMap map) : config_(config), map_(std::move(map)) {}

  // `camera`: that of the image, with its size. An input without image is found by its detections
  // alone. `prior`: the camera's supposed pose, world_from_cam; tried first, but the answer must
  // hold without it. Throws InputError.
  RelocalizationResult Find(const ImageInput& input, const Camera& camera, RelocalizationMode mode,
                            const std::optional<Rigid3>& prior = std::nullopt) const;
  // For an image whose camera is not known.
  RelocalizationResult FindWithUnknownCamera(const ImageInput& input,
                                             RelocalizationMode mode) const;

  const SavedMap& saved() const { return *map_.saved; }
  const IndexedMap& map() const { return map_; }
  const SlamConfig& config() const { return config_; }

 private:
  SlamConfig config_;
  IndexedMap map_;
};

}  // namespace oaslam
