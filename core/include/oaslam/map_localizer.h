#pragma once

#include <memory>
#include <string>

#include "oaslam/config.h"
#include "oaslam/export.h"
#include "oaslam/image_input.h"
#include "oaslam/map_snapshot.h"
#include "oaslam/relocalization_result.h"

namespace oaslam {

// Finds single images in a map that is only read. Any number of threads may call all functions at
// once: a call takes some 10 to 40 ms on its caller's thread, and ten times as long where the image
// is not found. All calls and all copies share one map:
//
//   const MapLocalizer localizer("room.map");
//   const RelocalizationResult found = localizer.Relocalize({image}, {.camera = camera});
//   if (found.world_from_cam) Draw(*found.world_from_cam);
class OASLAM_API MapLocalizer {
 public:
  // Throws InputError.
  explicit MapLocalizer(const MapSnapshot& map, const SlamConfig& config = SlamConfig::Offline());
  // The map of a file: MapSnapshot::Load.
  explicit MapLocalizer(const std::string& path, const SlamConfig& config = SlamConfig::Offline());

  // Finds an image as Slam::Relocalize does. Without `options.camera` the camera of the image
  // counts as unknown, and is found with the pose. Throws InputError.
  RelocalizationResult Relocalize(const ImageInput& input,
                                  const RelocalizeOptions& options = {}) const;

  // The map in which it looks for images.
  const MapSnapshot& map() const;

 private:
  class Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace oaslam
