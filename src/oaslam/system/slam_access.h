#pragma once

#include <cstdint>

#include "oaslam/class_names.h"
#include "oaslam/localization/image_search.h"
#include "oaslam/map/frame_view.h"
#include "oaslam/odometry/gyroscope.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// Access to Slam for the programs of this repository, beyond its public interface: values of types
// that the rooms share and whose headers are not installed.
class SlamAccess {
 public:
  // The state at the newest image, for display; large content is shared.
  static FrameView View(const Slam& slam);
  // Slam::Load of a map that is in memory: shares it.
  static void Load(Slam& slam, const IndexedMap& map);
  // A number that changes whenever a Slam begins with another map: by construction, Load or Reset.
  static uint64_t BeginningOf(const Slam& slam);
  // The names of classes.
  static const ClassNames& NamesOf(const Slam& slam);
  // What is known of the gyroscope whose samples came with the images.
  static const Gyroscope& GyroscopeOf(const Slam& slam);
  // The map with the trajectory so far.
  static SavedMap Export(const Slam& slam);
};

// Multiplies all lengths in a result, as those of its map were (Slam::SetMetresPerUnit).
void ScaleLengths(double factor, TrackingResult& result);

}  // namespace oaslam
