#pragma once

#include "oaslam/map/frame_view.h"
#include "oaslam/slam.h"
#include "oaslam/storage/map_file.h"

namespace oaslam {

// What the programs of this repository see of Slam beyond its public face: values of types that
// the rooms share, and whose headers are not installed.
class SlamAccess {
 public:
  // What was made of the newest image, for display; shares what it can.
  static FrameView View(const Slam& slam);
  // The map with the trajectory so far.
  static SavedMap Export(const Slam& slam);
};

}  // namespace oaslam
