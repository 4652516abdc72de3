#pragma once

#include "oaslam/camera.h"
#include "oaslam/formats/camera_reader.h"

namespace oaslam {

// Readers of calibrations that are mappings (docs/formats.md), one for each kind. They throw
// InputError.

// ROS camera_info (file or message) and OpenCV FileStorage.
bool HasCameraMatrix(const CameraReader& reader);
Camera ReadMatrixKind(const CameraReader& reader);

// The keys of a camera of ORB-SLAM2 and 3, OpenVSLAM or stella_vslam, which are "Camera.fx",
// "Camera1.fx", or below "Camera"; nothing where there are none.
std::optional<CameraReader> OrbSlamKeys(const CameraReader& reader);
Camera ReadOrbSlamKind(const CameraReader& reader);
// Kalibr's camchain (of cam0), and EuRoC's sensor.yaml, which has the same keys at the top.
Camera ReadKalibrKind(const CameraReader& reader);
// VINS-Mono and VINS-Fusion, whose settings name a file for each camera.
Camera ReadVinsKind(const CameraReader& reader);
// OKVIS: the first of "cameras".
Camera ReadOkvisKind(const CameraReader& reader);

// Nerfstudio's transforms.json, instant-ngp's too. The path of images and their poses are not read.
Camera ReadNerfstudioKind(const CameraReader& reader);
// Record3D's metadata: "K" by columns.
Camera ReadRecord3dKind(const CameraReader& reader);
// The file that 3D Scanner App writes for each image: "intrinsics" by rows, without a size.
Camera ReadScannerAppKind(const CameraReader& reader);
// The file that Polycam writes for each image.
Camera ReadPolycamKind(const CameraReader& reader);
// KITTI's calib.txt: rows "P0: fx 0 cx ..." of images without distortion, alike for all cameras.
Camera ReadKittiKind(const CameraReader& reader);

}  // namespace oaslam
