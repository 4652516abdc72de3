#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/angular_velocity.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// The rotation from the gyroscope's axes to those of the camera, which a calibration file gives as
// EuRoC's T_BS (the body is the gyroscope) or Kalibr's T_cam_imu. Nothing where the file has
// neither, and for "fov:DEGREES". Throws InputError where the matrix is no rotation.
std::optional<Eigen::Quaterniond> LoadCameraFromImu(const std::string& camera);

// The pose of the camera on the body, EuRoC's T_BS; nothing where the file does not have it. Throws
// as above.
std::optional<Rigid3> LoadBodyFromCamera(const std::string& camera);

// The gyroscope of EuRoC's imu0/data.csv: after a line that begins with '#', a time stamp in ns and
// the angular velocity about three axes in rad/s in each line; what follows, such as accelerations,
// is not read. Throws InputError that names path and line where a number is missing, times do not
// ascend, their median spacing is not within 0.1 ms to 0.1 s (another unit than ns), or it turns
// faster than any gyroscope measures, and where there are no samples.
std::vector<AngularVelocity> LoadImu(const std::string& path,
                                     const Eigen::Quaterniond& camera_from_imu);

}  // namespace oaslam
