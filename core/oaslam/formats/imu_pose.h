#pragma once

#include <optional>
#include <string>

#include "oaslam/rigid3.h"

namespace oaslam {

// The pose of the IMU relative to the camera, which a calibration file gives as Kalibr's T_cam_imu
// or, the other way round, as T_imu_cam, T_BS (EuRoC; the body is the IMU), Tbc, IMU.T_b_c1 or
// body_T_cam0: at its root or in cam0. Nothing where the file has none of them, and for
// "fov:DEGREES". Throws InputError, with path and key, where a matrix is no rigid motion, where its
// translation is longer than 10 m (millimetres), and where two of them contradict each other.
std::optional<Rigid3> LoadCameraFromImu(const std::string& camera);

// The pose of the camera on the body, EuRoC's T_BS; nothing where the file does not have it. Throws
// as above.
std::optional<Rigid3> LoadBodyFromCamera(const std::string& camera);

}  // namespace oaslam
