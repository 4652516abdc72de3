#pragma once

#include <string>

namespace oaslam {

// The image that hides what moves with a camera, as its calibration names it by the key `mask`
// beside that camera's keys or at the top, relative to the calibration's folder; empty where it
// names none. `spec` as for
// LoadCamera. Throws InputError where the key is no text.
std::string MaskOfCalibration(const std::string& spec);

}  // namespace oaslam
