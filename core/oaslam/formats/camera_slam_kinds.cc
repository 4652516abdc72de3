#include <fmt/ranges.h>

#include <algorithm>
#include <span>

#include "oaslam/formats/camera_kinds.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

// Camera models that have parameters before fx fy cx cy in "intrinsics".
struct KalibrModel {
  const char* name;
  size_t parameters;
};
constexpr KalibrModel kKalibrModels[] = {{"pinhole", 0}, {"omni", 1}, {"ds", 2}, {"eucm", 2}};

}  // namespace

Camera ReadOrbSlamKind(const CameraReader& reader) {
  reader.CheckKeys(
      "fx fy cx cy k1 k2 k3 k4 k5 k6 p1 p2 width height cols rows type model name setup fps RGB "
      "color_order bf focal_x_baseline depth_threshold newWidth newHeight overlappingBegin "
      "overlappingEnd");
  Camera camera;
  reader.ReadSize(camera, {"width", "cols"}, {"height", "rows"});
  if (const auto type = reader.Find({"model", "type"}))
    if (Lower(reader.Text({"model", "type"})) != "rectified")
      camera.model = LensModelOf(reader.Text({"model", "type"}), reader.Place(type->first));
  reader.ReadFocal(camera, {"fx"}, {"fy"}, {"cx"}, {"cy"});
  if (reader.Find({"type"}) && Lower(reader.Text({"type"})) == "rectified") return camera;
  if (camera.model == LensModel::kFisheye) {
    reader.CheckZero({"p1", "p2", "k5", "k6"}, "fisheye");
    SetDistortion(camera, reader.NumbersOf({"k1", "k2", "k3", "k4"}, 0), reader.Place("k1"));
  } else {
    SetDistortion(camera, reader.NumbersOf({"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"}, 0),
                  reader.Place("k4"));
  }
  return camera;
}

Camera ReadKalibrKind(const CameraReader& reader) {
  reader.CheckKeys(
      "camera_model intrinsics distortion_model distortion_coeffs distortion_coefficients "
      "resolution rostopic cam_overlaps T_cn_cnm1 T_cam_imu timeshift_cam_imu sensor_type comment "
      "T_BS rate_hz T_cam_depth");
  const std::string name =
      reader.Find({"camera_model"}) ? Lower(reader.Text({"camera_model"})) : "pinhole";
  const auto* model = std::ranges::find(kKalibrModels, name, &KalibrModel::name);
  if (model == std::end(kKalibrModels))
    throw BadInput("{}: {}camera_model: {}, allowed: pinhole | omni | ds | eucm", reader.path,
                   reader.prefix, TextOfNode(YAML::Node(name)));
  Camera camera;
  const auto values = reader.Numbers({"intrinsics"}, model->parameters + 4);
  const double* p = values.data() + model->parameters;
  camera.fx = p[0], camera.fy = p[1], camera.cx = p[2], camera.cy = p[3];
  reader.ReadSizeList(camera, "resolution");
  const auto coefficients_key = reader.Find({"distortion_coeffs", "distortion_coefficients"});
  const auto coefficients = coefficients_key
                                ? reader.Numbers({"distortion_coeffs", "distortion_coefficients"})
                                : std::vector<double>{};
  const std::string lens =
      reader.Find({"distortion_model"}) ? Lower(reader.Text({"distortion_model"})) : "none";
  if (name == "pinhole" && lens == "fov") {
    reader.Numbers({"distortion_coeffs", "distortion_coefficients"}, 1);
    SetLens(camera, FieldOfViewLens(coefficients[0]), lens, reader.Place(coefficients_key->first));
    return camera;
  }
  camera.model = LensModelOf(lens, reader.Place(reader.prefix + "distortion_model"));
  const std::string key = coefficients_key ? coefficients_key->first : reader.prefix + "intrinsics";
  const LensPlace place = reader.Place(key);
  if (name == "pinhole") {
    SetDistortion(camera, coefficients, place);
    return camera;
  }
  const bool is_distorted =
      std::ranges::any_of(coefficients, [](double value) { return value != 0; });
  if (is_distorted && (name != "omni" || camera.model == LensModel::kFisheye))
    throw BadInput("{}: {}: not known with camera_model {}, allowed: {}", reader.path, key, name,
                   name == "omni" ? "radtan" : "none");
  if (name == "omni") SetLens(camera, OmniLens(values[0], coefficients), name, place);
  if (name == "ds") SetLens(camera, DoubleSphereLens(values[0], values[1]), name, place);
  if (name == "eucm") SetLens(camera, ExtendedUnifiedLens(values[0], values[1]), name, place);
  return camera;
}

Camera ReadVinsKind(const CameraReader& reader) {
  const std::string name = Lower(reader.Text({"model_type"}));
  Camera camera;
  reader.ReadSize(camera, {"image_width"}, {"image_height"});
  const auto numbers = [&](const char* key, CameraKeys names) {
    const CameraReader below = reader.Below(key);
    below.CheckKeys(fmt::format("{}", fmt::join(names, " ")));
    return below.NumbersOf(names, 0);
  };
  if (name == "kannala_brandt") {
    camera.model = LensModel::kFisheye;
    const CameraReader projection = reader.Below("projection_parameters");
    const auto k =
        numbers("projection_parameters", {"k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0"});
    projection.ReadFocal(camera, {"mu"}, {"mv"}, {"u0"}, {"v0"});
    SetDistortion(camera, std::span(k).first(4), reader.Place("projection_parameters"));
    return camera;
  }
  const bool is_omni = name == "mei";
  if (!is_omni && name != "pinhole" && name != "pinhole_full")
    throw BadInput(
        "{}: model_type: {}, allowed: PINHOLE | KANNALA_BRANDT | MEI; calibrate the "
        "camera as one of these",
        reader.path, TextOfNode(reader.Need({"model_type"}).second));
  const CameraReader projection = reader.Below("projection_parameters");
  projection.CheckKeys("fx fy cx cy gamma1 gamma2 u0 v0");
  projection.ReadFocal(camera, {"fx", "gamma1"}, {"fy", "gamma2"}, {"cx", "u0"}, {"cy", "v0"});
  const auto k =
      reader.Find({"distortion_parameters"})
          ? numbers("distortion_parameters", {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
          : std::vector<double>{};
  if (is_omni)
    SetLens(camera, OmniLens(reader.Below("mirror_parameters").Number({"xi"}), k), "MEI",
            reader.Place("mirror_parameters.xi"));
  else
    SetDistortion(camera, k, reader.Place("distortion_parameters"));
  return camera;
}

Camera ReadOkvisKind(const CameraReader& reader) {
  const YAML::Node list = reader.root["cameras"];
  if (list.size() == 0 || !list[0].IsMap())
    throw BadInput("{}: cameras: {}, expected a list of cameras", reader.path, TextOfNode(list));
  const CameraReader first{reader.path, list[0], reader.image_size, "cameras[0]."};
  first.CheckKeys(
      "T_SC image_dimension distortion_coefficients distortion_type focal_length principal_point "
      "cam_model camera_model slam_use mapping image_delay");
  Camera camera;
  first.ReadSizeList(camera, "image_dimension");
  const auto focal = first.Numbers({"focal_length"}, 2),
             centre = first.Numbers({"principal_point"}, 2);
  camera.fx = focal[0], camera.fy = focal[1], camera.cx = centre[0], camera.cy = centre[1];
  if (first.Find({"cam_model", "camera_model"}))
    LensModelOf(first.Text({"cam_model", "camera_model"}), first.Place("cameras[0].cam_model"));
  if (first.Find({"distortion_type"}))
    camera.model =
        LensModelOf(first.Text({"distortion_type"}), first.Place("cameras[0].distortion_type"));
  if (first.Find({"distortion_coefficients"}))
    SetDistortion(camera, first.Numbers({"distortion_coefficients"}),
                  first.Place("cameras[0].distortion_coefficients"));
  return camera;
}

std::optional<CameraReader> OrbSlamKeys(const CameraReader& reader) {
  if (const auto below = reader.Find({"Camera"}); below && below->second.IsMap())
    return reader.Below("Camera");
  CameraReader camera{reader.path, YAML::Node(YAML::NodeType::Map), reader.image_size, "Camera."};
  for (const char* prefix : {"Camera.", "Camera1."})
    for (const auto& entry : reader.root) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (!key.starts_with(prefix)) continue;
      camera.root[key.substr(std::string_view(prefix).size())] = entry.second;
      camera.prefix = prefix;
    }
  return camera.root.size() > 0 ? std::optional(camera) : std::nullopt;
}

}  // namespace oaslam
