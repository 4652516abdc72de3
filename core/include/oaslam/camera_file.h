#pragma once

#include <opencv2/core.hpp>
#include <string>

#include "oaslam/camera.h"
#include "oaslam/export.h"

namespace oaslam {

// Loads a calibration: "fov:DEGREES" (horizontal; a guess, Camera::is_guess), or a file of a kind
// in docs/formats.md, recognised by its keys: ROS camera_info YAML, OpenCV FileStorage YAML,
// ORB-SLAM2/3 YAML, COLMAP cameras.txt, Kalibr camchain. `image_size`: the size of the images it is
// for; {0, 0} where that is not known (then fov: is refused). A file without a size gets this one.
// Throws InputError naming path, key, value and bound, also when the file's size differs from
// image_size.
OASLAM_API Camera LoadCamera(const std::string& spec, const cv::Size& image_size = {});

// Throws InputError, whose message begins with `where`, for impossible parameters of a camera.
OASLAM_API void CheckCalibration(const Camera& camera, const std::string& where);

// Returns a calibration as the text of a ROS camera_info file, which LoadCamera reads; `note`
// becomes a comment at its top.
OASLAM_API std::string CameraText(const Camera& camera, const std::string& note);

}  // namespace oaslam
