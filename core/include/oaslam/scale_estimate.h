#pragma once

#include <string>

namespace oaslam {

// How long the unit of a map is, by the usual sizes of the objects in it (MapSnapshot::
// EstimateScale). A world of models, all of one scale and filmed from as near as models are, looks
// like the full-sized one: nothing in its images tells them apart.
struct ScaleEstimate {
  // Whether it may be used; if not, `why_not` tells why.
  bool success = false;
  std::string why_not{};
  // Metres; also where the estimate is not to be believed, and 1 where there is none.
  double metres_per_unit = 1;
  // Standard deviation of metres_per_unit, divided by it.
  double relative_sigma = 0;
  int objects = 0, classes = 0;  // that agree with it
};

}  // namespace oaslam
