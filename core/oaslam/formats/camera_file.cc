#include "oaslam/camera_file.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "oaslam/camera.h"
#include "oaslam/formats/camera_kinds.h"
#include "oaslam/formats/camera_lines.h"
#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"
#include "oaslam/geometry/camera_check.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

constexpr std::string_view kFovPrefix = "fov:";

Camera CameraFromFieldOfView(const std::string& spec, const cv::Size& image_size) {
  const auto degrees = ParseNumber(std::string_view(spec).substr(kFovPrefix.size()));
  if (!degrees || *degrees < 5 || *degrees > 170)
    throw BadInput("{}: horizontal field of view in degrees, allowed: 5 to 170", spec);
  if (image_size.empty())
    throw BadInput("{}: a field of view needs images; give a calibration file", spec);
  Camera camera{.width = image_size.width, .height = image_size.height};
  // The image spans [-0.5, width - 0.5] in pixel coordinates.
  camera.fx = camera.fy = 0.5 * camera.width / std::tan(0.5 * *degrees * std::numbers::pi / 180);
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  camera.is_guess = true;
  camera.name = spec;
  return camera;
}

// Calibrations of other images, whose size was changed by hand, have their principal point aside.
void WarnOfPrincipalPoint(const std::string& path, const Camera& camera) {
  constexpr double kMost = 0.2;  // of the side: cropped images, too, are rarely farther aside
  if (std::abs(camera.cx / camera.width - 0.5) > kMost ||
      std::abs(camera.cy / camera.height - 0.5) > kMost)
    Log(LogLevel::kWarning,
        "{}: the principal point {:.0f} {:.0f} is far from the middle of images of {} x {}: is it "
        "the calibration of other images, about {:.0f} x {:.0f}?",
        path, camera.cx, camera.cy, camera.width, camera.height, 2 * camera.cx + 1,
        2 * camera.cy + 1);
}

[[noreturn]] void ThrowNoCalibration(const std::string& path) {
  throw BadInput(
      "{}: not a calibration; looked for camera_matrix (ROS, OpenCV), Camera.fx "
      "(ORB-SLAM, stella_vslam), cam0.intrinsics (Kalibr), model_type (VINS), cameras "
      "(OKVIS), fl_x (Nerfstudio), P0 (KITTI), ID MODEL (COLMAP), a line fx fy cx cy",
      path);
}

// YAML of a text that is no mapping.
bool IsMapping(const std::string& text) { return text.find_first_of(":<{") != std::string::npos; }

Camera ReadCameraFile(const std::string& path, const cv::Size& image_size) {
  const std::string text =
      path.ends_with("cameras.bin") ? TextOfColmapCameras(path) : ReadTextFile(path);
  if (const auto camera = ReadCameraLines(text, path, image_size)) return *camera;
  constexpr size_t kHead = 4096;
  if (!LooksLikeText(std::string_view(text).substr(0, kHead)) || !IsMapping(text))
    ThrowNoCalibration(path);
  const CameraReader reader{path, ParseCameraFile(text, path, image_size), image_size};
  if (const auto camera = OrbSlamKeys(reader)) return ReadOrbSlamKind(*camera);
  if (const auto cam0 = reader.Find({"cam0"}); cam0 && cam0->second.IsMap())
    return ReadKalibrKind(reader.Below("cam0"));
  if (const auto cameras = reader.Find({"cameras"}); cameras && cameras->second.IsSequence())
    return ReadOkvisKind(reader);
  if (reader.Find({"cameraPoseARFrame"})) return ReadScannerAppKind(reader);
  if (reader.Find({"intrinsics"})) return ReadKalibrKind(reader);
  if (reader.Find({"model_type"})) return ReadVinsKind(reader);
  if (reader.Find({"fl_x", "camera_angle_x"})) return ReadNerfstudioKind(reader);
  if (reader.Find({"K"}) && reader.Find({"w"})) return ReadRecord3dKind(reader);
  if (reader.Find({"P0", "P2"})) return ReadKittiKind(reader);
  if (HasCameraMatrix(reader)) return ReadMatrixKind(reader);
  if (reader.Find({"fx"}) && reader.Find({"width"})) return ReadPolycamKind(reader);
  if (const auto other = reader.Find({"cam0_calib"}))
    throw BadInput("{}: names the calibration {}; give that file", path, TextOfNode(other->second));
  ThrowNoCalibration(path);
}

}  // namespace

void CheckCalibration(const Camera& camera, const std::string& path) {
  const std::string problem = ProblemOf(camera);
  if (!problem.empty()) throw InputError(path + ": " + problem);
}

Camera LoadCamera(const std::string& spec, const cv::Size& image_size) {
  if (spec.starts_with(kFovPrefix)) return CameraFromFieldOfView(spec, image_size);
  Camera camera = ReadCameraFile(spec, image_size);
  if (camera.width == 0 && camera.height == 0) {
    if (image_size.empty())
      throw BadInput("{}: has no image size, and there are no images to take it from", spec);
    camera.width = image_size.width;
    camera.height = image_size.height;
  }
  CheckCalibration(camera, spec);
  if (!image_size.empty() &&
      (camera.width != image_size.width || camera.height != image_size.height))
    throw BadInput("{}: is for images of {} x {}, but they are {} x {}", spec, camera.width,
                   camera.height, image_size.width, image_size.height);
  WarnOfPrincipalPoint(spec, camera);
  return camera;
}

std::string CameraText(const Camera& camera, const std::string& note) {
  const bool is_fisheye = camera.model == LensModel::kFisheye;
  const int count = is_fisheye ? 4 : 5;
  std::string coefficients;
  for (int i = 0; i < count; ++i)
    coefficients +=
        fmt::format("{}{:.9g}", i > 0 ? ", " : "", camera.distortion[static_cast<size_t>(i)]);
  std::string head;
  for (const std::string_view line : SplitLines(note)) head += fmt::format("# {}\n", line);
  return head + fmt::format(
                    "camera_name: {}\n"
                    "image_width: {}\n"
                    "image_height: {}\n"
                    "camera_matrix:\n"
                    "  rows: 3\n"
                    "  cols: 3\n"
                    "  data: [{:.9g}, 0, {:.9g}, 0, {:.9g}, {:.9g}, 0, 0, 1]\n"
                    "distortion_model: {}\n"
                    "distortion_coefficients:\n"
                    "  rows: 1\n"
                    "  cols: {}\n"
                    "  data: [{}]\n",
                    JsonText(nlohmann::json(camera.name)), camera.width, camera.height, camera.fx,
                    camera.cx, camera.fy, camera.cy, is_fisheye ? "equidistant" : "plumb_bob",
                    count, coefficients);
}

}  // namespace oaslam
