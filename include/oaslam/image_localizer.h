#pragma once

#include <memory>
#include <optional>
#include <string>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/export.h"
#include "oaslam/image_input.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/relocalization_result.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// Finds single images in a saved map, each by itself, as Slam::Relocalize does. Any number of
// threads may call all functions at once: each call takes some 10 ms on its caller's thread. All
// calls and all copies share one map.
class OASLAM_API ImageLocalizer {
 public:
  // Loads a map file. `piece`: as for Slam::Load. Throws InputError.
  explicit ImageLocalizer(const std::string& map_path, const SlamConfig& config = {},
                          int piece = 0);
  ~ImageLocalizer();
  ImageLocalizer(const ImageLocalizer&);
  ImageLocalizer& operator=(const ImageLocalizer&);

  // `camera`: that of the image. Without an image, the detections alone are used. `prior`: the
  // camera's supposed pose, world_from_cam; the image's points are looked for there first, but the
  // answer must hold without it. RelocalizationMode::kObjects ignores it. The time stamp is not
  // used. Throws InputError.
  RelocalizationResult Localize(const ImageInput& input, const Camera& camera,
                                RelocalizationMode mode,
                                const std::optional<Rigid3>& prior = std::nullopt) const;
  // For an image whose camera is not known: Slam::RelocalizeWithUnknownCamera.
  RelocalizationResult LocalizeWithUnknownCamera(const ImageInput& input,
                                                 RelocalizationMode mode) const;

  // The map in which it looks for images.
  MapSnapshot Snapshot() const;

 private:
  friend struct LocalizerAccess;
  class Impl;
  explicit ImageLocalizer(std::shared_ptr<const Impl> impl);
  std::shared_ptr<const Impl> impl_;
};

}  // namespace oaslam
