#include <nlohmann/json.hpp>

#include "oaslam/error.h"
#include "oaslam/exports/export_ply.h"
#include "oaslam/exports/map_export.h"
#include "oaslam/formats/json_text.h"
#include "oaslam/formats/text.h"

namespace oaslam {
namespace {

using Json = nlohmann::ordered_json;

// Nerfstudio's rays go through (pixel + 0.5 - c) / f: the centre of its first pixel is at (0.5,
// 0.5), ours at (0, 0).
constexpr double kPixelCenter = 0.5;

Json Intrinsics(const Camera& c) {
  Json json = {
      {"fl_x", c.fx}, {"fl_y", c.fy}, {"cx", c.cx + kPixelCenter}, {"cy", c.cy + kPixelCenter},
      {"w", c.width}, {"h", c.height}};
  const auto& k = c.distortion;
  json["k1"] = k[0];
  json["k2"] = k[1];
  if (c.model == LensModel::kFisheye) {
    json["k3"] = k[2];
    json["k4"] = k[3];
  } else {
    json["p1"] = k[2];
    json["p2"] = k[3];
    json["k3"] = k[4];
  }
  return json;
}

Json Rows(const Eigen::MatrixXd& matrix) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) row.push_back(matrix(i, j));
    rows.push_back(std::move(row));
  }
  return rows;
}

LensModel OneModel(const Map& map) {
  for (const Camera& camera : map.cameras)
    if (camera.model != map.cameras.front().model)
      throw InputError(
          "nerfstudio: a file has one camera model, this map has pinhole and fisheye cameras");
  return map.cameras.front().model;
}

}  // namespace

void ExportNerfstudio(const std::string& folder, const SavedMap& saved,
                      const KeyframeImages& images) {
  const Map& map = saved.map;
  Json json;
  json["camera_model"] = OneModel(map) == LensModel::kFisheye ? "OPENCV_FISHEYE" : "OPENCV";
  const bool is_single = map.cameras.size() == 1;
  if (is_single) json.update(Intrinsics(map.cameras.front()));

  const Eigen::Matrix3d z_up_from_world = ZUpFromWorld(map);
  Eigen::MatrixXd applied = Eigen::MatrixXd::Zero(3, 4);
  applied.leftCols<3>() = z_up_from_world;
  json["applied_transform"] = Rows(applied);
  json["ply_file_path"] = "sparse_pc.ply";
  json["frames"] = Json::array();
  for (const auto& [id, image] : images) {
    const Keyframe& keyframe = map.keyframes.At(id);
    const Rigid3 world_from_cam = keyframe.cam_from_world.Inverse();
    // OpenGL's camera axes: x right, y up, z back.
    Eigen::MatrixXd pose = Eigen::MatrixXd::Identity(4, 4);
    pose.topLeftCorner<3, 3>() = z_up_from_world * world_from_cam.rotation.toRotationMatrix() *
                                 Eigen::Vector3d(1, -1, -1).asDiagonal();
    pose.topRightCorner<3, 1>() = z_up_from_world * world_from_cam.translation;
    Json frame = {{"file_path", image.path}};
    if (!is_single) frame.update(Intrinsics(map.cameras[static_cast<size_t>(keyframe.camera)]));
    frame["transform_matrix"] = Rows(pose);
    json["frames"].push_back(std::move(frame));
  }
  ColoredMesh cloud;
  for (const auto& [id, color] : ColorsOfLandmarks(map, images, folder)) {
    cloud.vertices.push_back(z_up_from_world * map.landmarks.At(id).position);
    cloud.colors.push_back(color);
  }
  WriteTextFile(folder + "/transforms.json", JsonText(json, 1) + "\n");
  SavePly(folder + "/sparse_pc.ply", cloud);
}

}  // namespace oaslam
