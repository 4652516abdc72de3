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
// once: each call takes some 10 to 40 ms on its caller's thread, and ten times that where it is not
// found. All calls and all copies share one map.
class OASLAM_API MapLocalizer {
 public:
  // Throws InputError.
  explicit MapLocalizer(const MapSnapshot& map, const SlamConfig& config = {});
  // The map of a file: MapSnapshot::Load.
  explicit MapLocalizer(const std::string& path, const SlamConfig& config = {});

  // As Slam::Relocalize, but that `options.camera` is the camera of the image, which is unknown
  // without it. Throws InputError.
  RelocalizationResult Relocalize(const ImageInput& input,
                                  const RelocalizeOptions& options = {}) const;

  // The map in which it looks for images.
  const MapSnapshot& map() const;

 private:
  class Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace oaslam
