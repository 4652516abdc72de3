#pragma once

#include "oaslam/map/frame_view.h"
#include "oaslam/slam.h"

namespace oaslam {

struct OASLAM_LOCAL Slam::View : FrameView {};  // with its map

}  // namespace oaslam
