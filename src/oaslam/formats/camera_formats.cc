#include "oaslam/formats/camera_formats.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/formats/camera_lines.h"
#include "oaslam/formats/colmap_model.h"
#include "oaslam/formats/lens_models.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

using Keys = std::initializer_list<const char*>;

// A mapping of a calibration file, and its path for messages.
struct Reader {
  std::string path;
  YAML::Node root;
  cv::Size image_size{};
  std::string prefix{};  // prefix of keys in messages

  // The first of the keys that exists, with its value.
  std::optional<std::pair<std::string, YAML::Node>> Find(Keys keys) const {
    for (const char* key : keys)
      if (const YAML::Node node = root[key]) return std::pair{prefix + key, node};
    return std::nullopt;
  }
  std::pair<std::string, YAML::Node> Need(Keys keys) const {
    if (auto found = Find(keys)) return *found;
    throw InputError(fmt::format("{}: key {}{} is missing", path, prefix, *keys.begin()));
  }
  double Number(Keys keys) const {
    const auto [key, node] = Need(keys);
    return YamlNumber(node, path, key);
  }
  double NumberOr(const std::string& key, double fallback) const {
    return Find({key.c_str()}) ? Number({key.c_str()}) : fallback;
  }
  std::vector<double> NumbersOf(Keys keys, double fallback) const {
    std::vector<double> values;
    for (const char* key : keys) values.push_back(NumberOr(key, fallback));
    return values;
  }
  // A list, or a matrix as a mapping with "data". `count`: how many, 0 for any.
  std::vector<double> Numbers(Keys keys, size_t count = 0) const {
    const auto [key, node] = Need(keys);
    auto values = node.IsMap() ? YamlNumbers(node["data"], path, key + ".data")
                               : YamlNumbers(node, path, key);
    if (count > 0 && values.size() != count)
      throw InputError(
          fmt::format("{}: {}: {} values, expected {}", path, key, values.size(), count));
    return values;
  }
  std::string Text(Keys keys) const {
    const auto [key, node] = Need(keys);
    return node.IsScalar() ? node.Scalar() : TextOfNode(node);
  }
  // The mapping below a key.
  Reader Below(const char* key) const {
    const auto [name, node] = Need({key});
    if (!node.IsMap())
      throw InputError(
          fmt::format("{}: {}: {}, expected \"key: value\" lines", path, name, TextOfNode(node)));
    return {path, node, image_size, name + "."};
  }
  LensPlace Place(const std::string& key) const { return {path, key, image_size}; }

  void ReadSize(Camera& camera, Keys width, Keys height) const {
    if (!Find(width) && !Find(height)) return;
    const auto [width_key, width_node] = Need(width);
    const auto [height_key, height_node] = Need(height);
    camera.width = YamlInteger(width_node, path, width_key, 1, kMaxSide);
    camera.height = YamlInteger(height_node, path, height_key, 1, kMaxSide);
  }
  // [width, height]
  void ReadSizeList(Camera& camera, const char* list) const {
    const auto found = Find({list});
    if (!found) return;
    const auto& [key, node] = *found;
    if (!node.IsSequence() || node.size() != 2)
      throw InputError(
          fmt::format("{}: {}: {}, expected [width, height]", path, key, TextOfNode(node)));
    camera.width = YamlInteger(node[0], path, key, 1, kMaxSide);
    camera.height = YamlInteger(node[1], path, key, 1, kMaxSide);
  }
  void ReadFocal(Camera& camera, Keys fx, Keys fy, Keys cx, Keys cy) const {
    camera.fx = Number(fx), camera.fy = Number(fy), camera.cx = Number(cx), camera.cy = Number(cy);
  }
  // Refuses keys beside these, and those that begin as one of `rest` does: they could be about the
  // lens.
  void CheckKeys(Keys known, Keys rest = {}) const {
    for (const auto& entry : root) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      const auto is_known = [&](const char* other) { return key == other; };
      const auto begins = [&](const char* other) { return key.starts_with(other); };
      if (key == "mask") continue;  // ours (camera_mask)
      if (std::ranges::any_of(known, is_known) || std::ranges::any_of(rest, begins)) continue;
      throw InputError(
          fmt::format("{}: {}{}: {}, a key that is not understood; known: {}. If it says nothing "
                      "about lens and image size, remove the line",
                      path, prefix, key, TextOfNode(entry.second), fmt::join(known, ", ")));
    }
  }
  // Refuses values other than 0 for keys that the model does not have.
  void CheckZero(Keys keys, const std::string& model) const {
    for (const char* key : keys)
      if (const double value = NumberOr(key, 0); value != 0)
        throw InputError(fmt::format("{}: {}{}: {}, but the model {} has no {}", path, prefix, key,
                                     value, model, key));
  }
};

// Whether a key that is not known could be about the lens: it names a part of it, or is nearly a
// known key.
bool MayBeAboutLens(const std::string& key, Keys known) {
  const std::string word = Lower(key);
  for (const char* part : {"dist", "lens", "model", "fisheye", "coef", "focal", "xi", "resolution"})
    if (word == part || (word.size() > 3 && std::string_view(part).size() > 2 &&
                         word.find(part) != std::string::npos))
      return true;
  constexpr size_t kLong = 5;  // shorter keys are near to many words
  return std::ranges::any_of(known, [&](const char* other) {
    return word.size() >= kLong && EditDistance(word, Lower(other)) <= 2;
  });
}

constexpr Keys kMatrixKeys = {
    "camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K", "k", "M1", "mtx"};
constexpr Keys kCoefficientKeys = {"distortion_coefficients",
                                   "Distortion_Coefficients",
                                   "distCoeffs",
                                   "dist_coeffs",
                                   "DistCoeffs",
                                   "distortionCoefficients",
                                   "D",
                                   "d",
                                   "D1",
                                   "dist"};
constexpr Keys kWidthKeys = {"image_width", "image_Width", "imageWidth", "width"},
               kHeightKeys = {"image_height", "image_Height", "imageHeight", "height"};
// Of ROS and of OpenCV's calibration program, besides.
constexpr Keys kOtherMatrixKeys = {"camera_name",
                                   "distortion_model",
                                   "fisheye_model",
                                   "rectification_matrix",
                                   "projection_matrix",
                                   "header",
                                   "R",
                                   "P",
                                   "binning_x",
                                   "binning_y",
                                   "roi",
                                   "calibration_time",
                                   "flags",
                                   "flag_value",
                                   "nframes",
                                   "nr_of_frames",
                                   "nrOfFrames",
                                   "avg_reprojection_error",
                                   "Avg_Reprojection_Error",
                                   "per_view_reprojection_errors",
                                   "Per_View_Reprojection_Errors",
                                   "rms",
                                   "reprojection_error"};

// Files of OpenCV hold whatever their writers added: what cannot be about the lens is only named.
void CheckMatrixKeys(const Reader& reader) {
  std::vector<std::string> unused;
  for (const auto& entry : reader.root) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    const auto is_known = [&](Keys keys) { return std::ranges::find(keys, key) != keys.end(); };
    bool is_close = false;
    bool known = false;
    for (const Keys keys :
         {kMatrixKeys, kCoefficientKeys, kWidthKeys, kHeightKeys, kOtherMatrixKeys}) {
      known = known || is_known(keys);
      is_close = is_close || MayBeAboutLens(key, keys);
    }
    if (known) continue;
    if (is_close)
      throw InputError(fmt::format(
          "{}: {}: {}, a key that is not understood; if it says nothing about lens and image size, "
          "remove the line",
          reader.path, key, TextOfNode(entry.second)));
    unused.push_back(key);
  }
  if (!unused.empty())
    Log(LogLevel::kInfo,
        fmt::format("{}: keys that are not used: {}", reader.path, fmt::join(unused, ", ")));
}

// A message of ROS tells of images that are parts of what the calibration is for.
void CheckWholeImage(const Reader& reader) {
  for (const char* key : {"binning_x", "binning_y"})
    if (const double binning = reader.NumberOr(key, 0); binning > 1)
      throw InputError(fmt::format("{}: {}: {}, allowed: 0 or 1", reader.path, key, binning));
  const auto roi = reader.Find({"roi"});
  if (!roi || !roi->second.IsMap()) return;
  const Reader part = reader.Below("roi");
  for (const char* key : {"x_offset", "y_offset"})
    if (const double offset = part.NumberOr(key, 0); offset != 0)
      throw InputError(fmt::format("{}: roi.{}: {}, allowed: 0", reader.path, key, offset));
}

// ROS camera_info (file or message) and OpenCV FileStorage: a 3 x 3 matrix and a list of
// coefficients.
Camera ReadMatrixKind(const Reader& reader) {
  CheckMatrixKeys(reader);
  CheckWholeImage(reader);
  Camera camera;
  reader.ReadSize(camera, kWidthKeys, kHeightKeys);
  const auto matrix_key = reader.Need(kMatrixKeys).first;
  const auto k = reader.Numbers(kMatrixKeys, 9);
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    throw InputError(fmt::format("{}: {}: [{}], expected [fx 0 cx 0 fy cy 0 0 1]", reader.path,
                                 matrix_key, fmt::join(k, " ")));
  camera.fx = k[0], camera.cx = k[2], camera.fy = k[4], camera.cy = k[5];
  if (const auto name = reader.Find({"camera_name"}); name && name->second.IsScalar())
    camera.name = name->second.Scalar();
  if (reader.Find({"distortion_model"}))
    camera.model = LensModelOf(reader.Text({"distortion_model"}), reader.Place("distortion_model"));
  if (reader.NumberOr("fisheye_model", 0) != 0) camera.model = LensModel::kFisheye;
  if (const auto found = reader.Find(kCoefficientKeys))
    SetDistortion(camera, reader.Numbers(kCoefficientKeys), reader.Place(found->first));
  return camera;
}

// ORB-SLAM2 and 3, OpenVSLAM, stella_vslam: "Camera.fx", "Camera1.fx", or keys below "Camera".
Camera ReadOrbSlamKind(const Reader& reader) {
  reader.CheckKeys({"fx",
                    "fy",
                    "cx",
                    "cy",
                    "k1",
                    "k2",
                    "k3",
                    "k4",
                    "k5",
                    "k6",
                    "p1",
                    "p2",
                    "width",
                    "height",
                    "cols",
                    "rows",
                    "type",
                    "model",
                    "name",
                    "setup",
                    "fps",
                    "RGB",
                    "color_order",
                    "bf",
                    "focal_x_baseline",
                    "depth_threshold",
                    "newWidth",
                    "newHeight",
                    "overlappingBegin",
                    "overlappingEnd"});
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

// Camera models that have parameters before fx fy cx cy in "intrinsics".
struct KalibrModel {
  const char* name;
  size_t parameters;
};
constexpr KalibrModel kKalibrModels[] = {{"pinhole", 0}, {"omni", 1}, {"ds", 2}, {"eucm", 2}};

// Kalibr's camchain (of cam0), and EuRoC's sensor.yaml, which has the same keys at the top.
Camera ReadKalibrKind(const Reader& reader) {
  reader.CheckKeys({"camera_model", "intrinsics", "distortion_model", "distortion_coeffs",
                    "distortion_coefficients", "resolution", "rostopic", "cam_overlaps",
                    "T_cn_cnm1", "T_cam_imu", "timeshift_cam_imu", "sensor_type", "comment", "T_BS",
                    "rate_hz"});
  const std::string name =
      reader.Find({"camera_model"}) ? Lower(reader.Text({"camera_model"})) : "pinhole";
  const auto* model = std::ranges::find(kKalibrModels, name, &KalibrModel::name);
  if (model == std::end(kKalibrModels))
    throw InputError(fmt::format("{}: {}camera_model: {}, allowed: pinhole | omni | ds | eucm",
                                 reader.path, reader.prefix, TextOfNode(YAML::Node(name))));
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
    throw InputError(fmt::format("{}: {}: not known with camera_model {}, allowed: {}", reader.path,
                                 key, name, name == "omni" ? "radtan" : "none"));
  if (name == "omni") SetLens(camera, OmniLens(values[0], coefficients), name, place);
  if (name == "ds") SetLens(camera, DoubleSphereLens(values[0], values[1]), name, place);
  if (name == "eucm") SetLens(camera, ExtendedUnifiedLens(values[0], values[1]), name, place);
  return camera;
}

// VINS-Mono and VINS-Fusion, whose settings name a file for each camera.
Camera ReadVinsKind(const Reader& reader) {
  const std::string name = Lower(reader.Text({"model_type"}));
  Camera camera;
  reader.ReadSize(camera, {"image_width"}, {"image_height"});
  const auto numbers = [&](const char* key, Keys names) {
    const Reader below = reader.Below(key);
    below.CheckKeys(names);
    return below.NumbersOf(names, 0);
  };
  if (name == "kannala_brandt") {
    camera.model = LensModel::kFisheye;
    const Reader projection = reader.Below("projection_parameters");
    const auto k =
        numbers("projection_parameters", {"k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0"});
    projection.ReadFocal(camera, {"mu"}, {"mv"}, {"u0"}, {"v0"});
    SetDistortion(camera, std::span(k).first(4), reader.Place("projection_parameters"));
    return camera;
  }
  const bool is_omni = name == "mei";
  if (!is_omni && name != "pinhole" && name != "pinhole_full")
    throw InputError(
        fmt::format("{}: model_type: {}, allowed: PINHOLE | KANNALA_BRANDT | MEI; calibrate the "
                    "camera as one of these",
                    reader.path, TextOfNode(reader.Need({"model_type"}).second)));
  const Reader projection = reader.Below("projection_parameters");
  projection.CheckKeys({"fx", "fy", "cx", "cy", "gamma1", "gamma2", "u0", "v0"});
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

// OKVIS: the first of "cameras".
Camera ReadOkvisKind(const Reader& reader) {
  const YAML::Node list = reader.root["cameras"];
  if (list.size() == 0 || !list[0].IsMap())
    throw InputError(
        fmt::format("{}: cameras: {}, expected a list of cameras", reader.path, TextOfNode(list)));
  const Reader first{reader.path, list[0], reader.image_size, "cameras[0]."};
  first.CheckKeys({"T_SC", "image_dimension", "distortion_coefficients", "distortion_type",
                   "focal_length", "principal_point", "cam_model", "camera_model", "slam_use",
                   "mapping", "image_delay"});
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

// Nerfstudio's transforms.json, instant-ngp's too. The path of images and their poses are not read.
Camera ReadNerfstudioKind(const Reader& reader) {
  reader.CheckKeys({"camera_model",
                    "fl_x",
                    "fl_y",
                    "cx",
                    "cy",
                    "w",
                    "h",
                    "k1",
                    "k2",
                    "k3",
                    "k4",
                    "p1",
                    "p2",
                    "camera_angle_x",
                    "camera_angle_y",
                    "is_fisheye",
                    "frames",
                    "aabb_scale",
                    "scale",
                    "offset",
                    "applied_transform",
                    "applied_scale",
                    "orientation_override",
                    "auto_scale_poses_override",
                    "ply_file_path",
                    "depth_unit_scale_factor",
                    "integer_depth_scale",
                    "fps",
                    "frame_rate",
                    "aabb",
                    "up",
                    "n_frames",
                    "sharpness",
                    "enable_depth_loading",
                    "camera_orientation",
                    "rolling_shutter"},
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

// Record3D's metadata: "K" by columns.
Camera ReadRecord3dKind(const Reader& reader) {
  Camera camera;
  reader.ReadSize(camera, {"w"}, {"h"});
  const auto k = reader.Numbers({"K"}, 9);
  camera.fx = k[0], camera.fy = k[4], camera.cx = k[6], camera.cy = k[7];
  if (k[2] != 0 || k[5] != 0 || k[8] != 1)
    throw InputError(fmt::format("{}: K: [{}], expected [fx 0 0 0 fy 0 cx cy 1]", reader.path,
                                 fmt::join(k, " ")));
  return camera;
}

// KITTI's calib.txt: rows "P0: fx 0 cx ..." of images without distortion, alike for all cameras.
Camera ReadKittiKind(const Reader& reader) {
  std::optional<Camera> camera;
  for (const char* key : {"P0", "P1", "P2", "P3"}) {
    const auto found = reader.Find({key});
    if (!found) continue;
    std::vector<double> p;
    const std::string row = reader.Text({key});
    for (const std::string_view field : SplitFields(row))
      p.push_back(ParseNumber(field).value_or(std::nan("")));
    if (p.size() != 12 || std::ranges::any_of(p, [](double x) { return std::isnan(x); }))
      throw InputError(fmt::format("{}: {}: {}, expected 12 numbers", reader.path, key,
                                   TextOfNode(found->second)));
    Camera next;
    next.fx = p[0], next.cx = p[2], next.fy = p[5], next.cy = p[6];
    if (camera && *camera != next)
      throw InputError(fmt::format(
          "{}: {}: another camera than the ones before; write \"fx fy cx cy\" of the one that took "
          "the images to a file, and give that",
          reader.path, key));
    camera = next;
  }
  return *camera;
}

// Of OpenCV's FileStorage in XML, which it reads itself.
YAML::Node NodeOf(const cv::FileNode& file) {
  YAML::Node node;
  if (file.isMap())
    for (const std::string& key : file.keys()) node[key] = NodeOf(file[key]);
  else if (file.isSeq())
    for (const cv::FileNode& child : file) node.push_back(NodeOf(child));
  else if (file.isInt() || file.isReal())
    node = fmt::format("{:.17g}", static_cast<double>(file));
  else if (file.isString())
    node = file.string();
  return node;
}

YAML::Node ParseXml(const std::string& text, const std::string& path) {
  try {
    const cv::FileStorage storage(
        text, cv::FileStorage::READ | cv::FileStorage::MEMORY | cv::FileStorage::FORMAT_XML);
    YAML::Node root = NodeOf(storage.root());
    if (root.IsMap()) return root;
  } catch (const cv::Exception&) {
  }
  throw InputError(
      fmt::format("{}: XML, expected that of OpenCV's FileStorage (<opencv_storage>)", path));
}

// JSON is nearly YAML, but blanks of any kind may stand in it. Only scalars and lists of them are
// looked at.
YAML::Node ParseJsonCamera(const std::string& text, const std::string& path) {
  YAML::Node root(YAML::NodeType::Map);
  try {
    const auto json = nlohmann::json::parse(text);
    for (const auto& [key, value] : json.items()) {
      if (value.is_string())
        root[key] = value.get<std::string>();
      else if (value.is_primitive())
        root[key] = value.dump();
      else if (value.is_array() &&
               std::ranges::all_of(value, [](const auto& x) { return x.is_number(); }))
        for (const auto& x : value) root[key].push_back(x.dump());
      else
        root[key] = YAML::Node(YAML::NodeType::Map);
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: no JSON: {}", path, error.what()));
  }
  return root;
}

YAML::Node Parse(const std::string& text, const std::string& path) {
  const std::string_view start = Trim(text);
  if (start.starts_with("<")) return ParseXml(text, path);
  if (path.ends_with(".json") && start.starts_with("{")) return ParseJsonCamera(text, path);
  return ParseYamlMapping(text, path);
}

// The keys "Camera.fx" (or "Camera1.fx") of the root as "fx", those of "Camera1" before those of
// "Camera", or the keys below "Camera"; nothing where there are none.
std::optional<Reader> OrbSlamKeys(const Reader& reader) {
  if (const auto below = reader.Find({"Camera"}); below && below->second.IsMap())
    return reader.Below("Camera");
  Reader camera{reader.path, YAML::Node(YAML::NodeType::Map), reader.image_size, "Camera."};
  for (const char* prefix : {"Camera.", "Camera1."})
    for (const auto& entry : reader.root) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (!key.starts_with(prefix)) continue;
      camera.root[key.substr(std::string_view(prefix).size())] = entry.second;
      camera.prefix = prefix;
    }
  return camera.root.size() > 0 ? std::optional(camera) : std::nullopt;
}

}  // namespace

Camera ReadCameraFile(const std::string& path, const cv::Size& image_size) {
  const std::string text =
      path.ends_with("cameras.bin") ? TextOfColmapCameras(path) : ReadTextFile(path);
  if (const auto camera = ReadCameraLines(text, path, image_size)) return *camera;
  const Reader reader{path, Parse(text, path), image_size};
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
  if (reader.Find(kMatrixKeys)) return ReadMatrixKind(reader);
  if (const auto other = reader.Find({"cam0_calib"}))
    throw InputError(fmt::format("{}: names the calibration {}; give that file", path,
                                 TextOfNode(other->second)));
  throw InputError(
      fmt::format("{}: not a calibration; looked for camera_matrix (ROS, OpenCV), Camera.fx "
                  "(ORB-SLAM, stella_vslam), cam0.intrinsics (Kalibr), model_type (VINS), cameras "
                  "(OKVIS), fl_x (Nerfstudio), P0 (KITTI), ID MODEL (COLMAP), a line fx fy cx cy",
                  path));
}

}  // namespace oaslam
