#include "oaslam/formats/camera_formats.h"

#include <fmt/format.h>

#include "oaslam/error.h"
#include "oaslam/formats/camera_kinds.h"
#include "oaslam/formats/camera_lines.h"
#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/text.h"

namespace oaslam {
namespace {

[[noreturn]] void ThrowNoCalibration(const std::string& path) {
  throw InputError(
      fmt::format("{}: not a calibration; looked for camera_matrix (ROS, OpenCV), Camera.fx "
                  "(ORB-SLAM, stella_vslam), cam0.intrinsics (Kalibr), model_type (VINS), cameras "
                  "(OKVIS), fl_x (Nerfstudio), P0 (KITTI), ID MODEL (COLMAP), a line fx fy cx cy",
                  path));
}

// YAML of a text that is no mapping.
bool IsMapping(const std::string& text) { return text.find_first_of(":<{") != std::string::npos; }

}  // namespace

Camera ReadCameraFile(const std::string& path, const cv::Size& image_size) {
  const std::string text =
      path.ends_with("cameras.bin") ? TextOfColmapCameras(path) : ReadTextFile(path);
  if (const auto camera = ReadCameraLines(text, path, image_size)) return *camera;
  constexpr size_t kHead = 4096;
  if (!LooksLikeText(std::string_view(text).substr(0, kHead)) || !IsMapping(text))
    ThrowNoCalibration(path);
  const CameraReader reader{path, ParseCameraFile(text, path), image_size};
  if (const auto camera = OrbSlamKeys(reader)) return ReadOrbSlamKind(*camera);
  if (const auto cam0 = reader.Find({"cam0"}); cam0 && cam0->second.IsMap())
    return ReadKalibrKind(reader.Below("cam0"));
  if (const auto cameras = reader.Find({"cameras"}); cameras && cameras->second.IsSequence())
    return ReadOkvisKind(reader);
  if (reader.Find({"intrinsics"})) return ReadKalibrKind(reader);
  if (reader.Find({"model_type"})) return ReadVinsKind(reader);
  if (reader.Find({"fl_x", "camera_angle_x"})) return ReadNerfstudioKind(reader);
  if (reader.Find({"K"}) && reader.Find({"w"})) return ReadRecord3dKind(reader);
  if (reader.Find({"P0", "P2"})) return ReadKittiKind(reader);
  if (HasCameraMatrix(reader)) return ReadMatrixKind(reader);
  if (const auto other = reader.Find({"cam0_calib"}))
    throw InputError(fmt::format("{}: names the calibration {}; give that file", path,
                                 TextOfNode(other->second)));
  ThrowNoCalibration(path);
}

}  // namespace oaslam
