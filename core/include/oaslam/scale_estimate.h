#pragma once

#include <string>

namespace oaslam {

// How long the unit of a map is, by the usual sizes of the objects in it (MapSnapshot::
// EstimateScale). A scene of scale models, all of one scale and filmed from correspondingly near,
// gives the same images as the full-sized scene: the estimate cannot distinguish the two:
//
//   const ScaleEstimate scale = slam.WholeMap().EstimateScale();
//   if (scale.success) slam.SetMetresPerUnit(scale);
struct ScaleEstimate {
  // Whether it may be used; if not, `why_not` tells why.
  bool success = false;
  std::string why_not{};
  // Metres; set also where `success` is false because the estimate is not reliable; 1 where there
  // is no estimate.
  double metres_per_unit = 1;
  // Standard deviation of metres_per_unit, divided by it.
  double relative_sigma = 0;
  int objects = 0, classes = 0;  // that agree with it
};

}  // namespace oaslam
