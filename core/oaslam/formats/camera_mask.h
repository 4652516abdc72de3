#pragma once

#include <string>

namespace oaslam {

// The path of the mask image of what moves with a camera, which the calibration names by the key
// `mask` (beside the camera's keys or at the top, relative to the calibration's folder); empty
// where the calibration names none. `spec` as for LoadCamera. Throws InputError where the key is no
// text.
std::string MaskOfCalibration(const std::string& spec);

}  // namespace oaslam
