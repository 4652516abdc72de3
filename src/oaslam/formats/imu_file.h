#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "oaslam/angular_velocity.h"

namespace oaslam {

// How the camera lies to the gyroscope beside it, as its calibration file says: EuRoC's T_BS (the
// body is the gyroscope) or Kalibr's T_cam_imu. The identity where it says nothing, and for
// "fov:DEGREES": samples are about the camera's axes then. Throws InputError where the matrix is no
// rotation.
Eigen::Quaterniond LoadCameraFromImu(const std::string& camera);

// The gyroscope of EuRoC's imu0/data.csv: after a line that begins with '#', a time stamp in ns and
// the angular velocity about three axes in rad/s in each line; what follows, such as accelerations,
// is not read. Throws InputError that names path and line where a number is missing, times do not
// ascend or it turns faster than any gyroscope measures, and where there are no samples.
std::vector<AngularVelocity> LoadImu(const std::string& path,
                                     const Eigen::Quaterniond& camera_from_imu);

}  // namespace oaslam
