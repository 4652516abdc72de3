#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/formats/camera_kinds.h"
#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {

Camera ReadNerfstudioKind(const CameraReader& reader) {
  reader.CheckKeys(
      "camera_model fl_x fl_y cx cy w h k1 k2 k3 k4 p1 p2 camera_angle_x camera_angle_y is_fisheye "
      "frames aabb_scale scale offset applied_transform applied_scale orientation_override "
      "auto_scale_poses_override ply_file_path depth_unit_scale_factor integer_depth_scale fps "
      "frame_rate aabb up n_frames sharpness enable_depth_loading camera_orientation "
      "rolling_shutter",
      {"train", "val", "test"});
  Camera camera;
  reader.ReadSize(camera, {"w"}, {"h"});
  if (camera.width == 0) {
    camera.width = reader.image_size.width;
    camera.height = reader.image_size.height;
  }
  if (reader.Find({"fl_x"})) {
    camera.fx = reader.Number({"fl_x"});
  } else {
    camera.fx = 0.5 * camera.width / std::tan(0.5 * reader.Number({"camera_angle_x"}));
  }
  camera.fy = reader.Find({"fl_y"}) ? reader.Number({"fl_y"}) : camera.fx;
  constexpr double kPixelCentre = 0.5;  // at half integers, as COLMAP's; ours are at integers
  camera.cx = reader.NumberOr("cx", 0.5 * camera.width) - kPixelCentre;
  camera.cy = reader.NumberOr("cy", 0.5 * camera.height) - kPixelCentre;
  if (reader.Find({"camera_model"}))
    camera.model = LensModelOf(reader.Text({"camera_model"}), reader.Place("camera_model"));
  if (const auto fisheye = reader.Find({"is_fisheye"});
      fisheye && Lower(reader.Text({"is_fisheye"})) == "true")
    camera.model = LensModel::kFisheye;
  const auto k = reader.NumbersOf({"k1", "k2", "k3", "k4"}, 0);
  const double p1 = reader.NumberOr("p1", 0), p2 = reader.NumberOr("p2", 0);
  if (camera.model == LensModel::kFisheye) {
    reader.CheckZero({"p1", "p2"}, "fisheye");
    SetDistortion(camera, k, reader.Place("k1"));
  } else if (k[3] != 0) {
    SetLens(camera, FourRadialLens(k, p1, p2), "OPENCV with k4", reader.Place("k4"));
  } else {
    SetDistortion(camera, std::array{k[0], k[1], p1, p2, k[2]}, reader.Place("k1"));
  }
  return camera;
}

Camera ReadRecord3dKind(const CameraReader& reader) {
  Camera camera;
  reader.ReadSize(camera, {"w"}, {"h"});
  const auto k = reader.Numbers({"K"}, 9);
  camera.fx = k[0], camera.fy = k[4], camera.cx = k[6], camera.cy = k[7];
  if (k[2] != 0 || k[5] != 0 || k[8] != 1)
    throw BadInput("{}: K: [{}], expected [fx 0 0 0 fy 0 cx cy 1]", reader.path, fmt::join(k, " "));
  return camera;
}

Camera ReadScannerAppKind(const CameraReader& reader) {
  Camera camera;
  const auto k = reader.Numbers({"intrinsics"}, 9);
  camera.fx = k[0], camera.fy = k[4], camera.cx = k[2], camera.cy = k[5];
  if (k[6] != 0 || k[7] != 0 || k[8] != 1)
    throw BadInput("{}: intrinsics: [{}], expected [fx 0 cx 0 fy cy 0 0 1]", reader.path,
                   fmt::join(k, " "));
  return camera;
}

Camera ReadPolycamKind(const CameraReader& reader) {
  // With a pose it is Polycam's, which has no distortion; else another key may be of one.
  if (!reader.Find({"t_00"}))
    reader.CheckKeys(
        "fx fy cx cy width height timestamp blur_score center_depth manual_keyframe neighbors");
  Camera camera;
  reader.ReadSize(camera, {"width"}, {"height"});
  reader.ReadFocal(camera, {"fx"}, {"fy"}, {"cx"}, {"cy"});
  return camera;
}

Camera ReadKittiKind(const CameraReader& reader) {
  std::optional<Camera> camera;
  for (const char* key : {"P0", "P1", "P2", "P3"}) {
    const auto found = reader.Find({key});
    if (!found) continue;
    std::vector<double> p;
    const std::string row = reader.Text({key});
    for (const std::string_view field : SplitFields(row))
      p.push_back(ParseNumber(field).value_or(std::nan("")));
    if (p.size() != 12 || std::ranges::any_of(p, [](double x) { return std::isnan(x); }))
      throw BadInput("{}: {}: {}, expected 12 numbers", reader.path, key,
                     TextOfNode(found->second));
    Camera next;
    next.fx = p[0], next.cx = p[2], next.fy = p[5], next.cy = p[6];
    if (camera && *camera != next)
      throw BadInput(
          "{}: {}: another camera than the ones before; write \"fx fy cx cy\" of the one that took "
          "the images to a file, and give that",
          reader.path, key);
    camera = next;
  }
  return *camera;
}

}  // namespace oaslam
