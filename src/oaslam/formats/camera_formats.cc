#include "oaslam/formats/camera_formats.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <initializer_list>
#include <optional>
#include <span>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

constexpr int kMaxSide = 1'000'000;  // pixels; CheckCalibration has the bounds

// A mapping of a calibration file, and its path for messages.
struct Reader {
  std::string path;
  YAML::Node root;
  std::string prefix{};  // prefix of keys in messages

  // The first of the keys that exists, with its value.
  std::optional<std::pair<std::string, YAML::Node>> Find(
      std::initializer_list<const char*> keys) const {
    for (const char* key : keys)
      if (const YAML::Node node = root[key]) return std::pair{prefix + key, node};
    return std::nullopt;
  }
  std::pair<std::string, YAML::Node> Need(std::initializer_list<const char*> keys) const {
    if (auto found = Find(keys)) return *found;
    throw InputError(fmt::format("{}: key {}{} is missing", path, prefix, *keys.begin()));
  }
  double Number(std::initializer_list<const char*> keys) const {
    const auto [key, node] = Need(keys);
    return YamlNumber(node, path, key);
  }
  double NumberOr(const char* key, double fallback) const {
    return Find({key}) ? Number({key}) : fallback;
  }
  // A list, or a matrix as a mapping with "data".
  std::vector<double> Numbers(std::initializer_list<const char*> keys) const {
    const auto [key, node] = Need(keys);
    return node.IsMap() ? YamlNumbers(node["data"], path, key + ".data")
                        : YamlNumbers(node, path, key);
  }
  void ReadSize(Camera& camera, std::initializer_list<const char*> width,
                std::initializer_list<const char*> height) const {
    if (!Find(width) && !Find(height)) return;
    const auto [width_key, width_node] = Need(width);
    const auto [height_key, height_node] = Need(height);
    camera.width = YamlInteger(width_node, path, width_key, 1, kMaxSide);
    camera.height = YamlInteger(height_node, path, height_key, 1, kMaxSide);
  }
};

void SetDistortion(Camera& camera, std::span<const double> values, const std::string& path,
                   const std::string& key) {
  const size_t used = camera.model == LensModel::kFisheye ? 4 : 5;
  if (values.size() == 1 ||
      (camera.model == LensModel::kFisheye && !values.empty() && values.size() < 4))
    throw InputError(fmt::format("{}: {}: {} values, expected {}", path, key, values.size(), used));
  for (size_t i = 0; i < values.size(); ++i) {
    if (i < used)
      camera.distortion[i] = values[i];
    else if (values[i] != 0)
      throw InputError(fmt::format("{}: {}[{}]: {}, only {} coefficients are supported", path, key,
                                   i, values[i], used));
  }
}

LensModel ModelOf(const std::string& name, const std::string& path, const std::string& key) {
  const std::string word = Lower(name);
  for (const char* known : {"equidistant", "equidist", "fisheye", "kannalabrandt8",
                            "kannala_brandt4", "kannala_brandt"})
    if (word == known) return LensModel::kFisheye;
  for (const char* known :
       {"plumb_bob", "rational_polynomial", "radtan", "radial-tangential", "none", "pinhole", ""})
    if (word == known) return LensModel::kPinhole;
  throw InputError(fmt::format(
      "{}: {}: {}, allowed: radial-tangential (plumb_bob, radtan) | fisheye (equidistant)", path,
      key, TextOfNode(YAML::Node(name))));
}

// ROS camera_info (file or message) and OpenCV FileStorage: a 3 x 3 matrix and a list of
// coefficients.
Camera ReadMatrixKind(const Reader& reader) {
  Camera camera;
  reader.ReadSize(camera, {"image_width", "image_Width", "width"},
                  {"image_height", "image_Height", "height"});
  const auto matrix_key =
      reader.Need({"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K", "k"})
          .first;
  const auto k =
      reader.Numbers({"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K", "k"});
  if (k.size() != 9)
    throw InputError(
        fmt::format("{}: {}: {} values, expected 9", reader.path, matrix_key, k.size()));
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1)
    throw InputError(fmt::format("{}: {}: [{}], expected [fx 0 cx 0 fy cy 0 0 1]", reader.path,
                                 matrix_key, fmt::join(k, " ")));
  camera.fx = k[0], camera.cx = k[2], camera.fy = k[4], camera.cy = k[5];
  if (const auto model = reader.Find({"distortion_model"}))
    camera.model =
        ModelOf(model->second.IsScalar() ? model->second.Scalar() : TextOfNode(model->second),
                reader.path, model->first);
  if (reader.NumberOr("fisheye_model", 0) != 0) camera.model = LensModel::kFisheye;
  const auto coefficients = {"distortion_coefficients",
                             "Distortion_Coefficients",
                             "distCoeffs",
                             "dist_coeffs",
                             "DistCoeffs",
                             "D",
                             "d"};
  if (const auto found = reader.Find(coefficients))
    SetDistortion(camera, reader.Numbers(coefficients), reader.path, found->first);
  if (const auto name = reader.Find({"camera_name"}); name && name->second.IsScalar())
    camera.name = name->second.Scalar();
  return camera;
}

// ORB-SLAM2 and 3: "Camera.fx" or "Camera1.fx".
Camera ReadOrbSlamKind(const Reader& reader) {
  Camera camera;
  reader.ReadSize(camera, {"Camera.width"}, {"Camera.height"});
  camera.fx = reader.Number({"Camera1.fx", "Camera.fx"});
  camera.fy = reader.Number({"Camera1.fy", "Camera.fy"});
  camera.cx = reader.Number({"Camera1.cx", "Camera.cx"});
  camera.cy = reader.Number({"Camera1.cy", "Camera.cy"});
  if (const auto type = reader.Find({"Camera.type"})) {
    if (Lower(type->second.Scalar()) == "rectified") return camera;
    camera.model = ModelOf(type->second.Scalar(), reader.path, type->first);
  }
  const char* base = reader.Find({"Camera1.fx"}) ? "Camera1." : "Camera.";
  const auto names = camera.model == LensModel::kFisheye
                         ? std::vector{"k1", "k2", "k3", "k4"}
                         : std::vector{"k1", "k2", "p1", "p2", "k3"};
  for (size_t i = 0; i < names.size(); ++i) {
    const std::string key = std::string(base) + names[i];
    camera.distortion[i] = reader.NumberOr(key.c_str(), 0);
  }
  return camera;
}

// Kalibr's camchain (of cam0), and EuRoC's sensor.yaml, which has the same keys at the top.
Camera ReadKalibrKind(const Reader& reader) {
  Camera camera;
  if (const auto model = reader.Find({"camera_model"});
      model && Lower(model->second.Scalar()) != "pinhole")
    throw InputError(fmt::format("{}: {}: {}, allowed: pinhole", reader.path, model->first,
                                 TextOfNode(model->second)));
  const auto values = reader.Numbers({"intrinsics"});
  if (values.size() != 4)
    throw InputError(fmt::format("{}: {}intrinsics: {} values, expected fx fy cx cy", reader.path,
                                 reader.prefix, values.size()));
  camera.fx = values[0], camera.fy = values[1], camera.cx = values[2], camera.cy = values[3];
  if (reader.Find({"resolution"})) {
    const auto [key, node] = reader.Need({"resolution"});
    if (!node.IsSequence() || node.size() != 2)
      throw InputError(
          fmt::format("{}: {}: {}, expected [width, height]", reader.path, key, TextOfNode(node)));
    camera.width = YamlInteger(node[0], reader.path, key, 1, kMaxSide);
    camera.height = YamlInteger(node[1], reader.path, key, 1, kMaxSide);
  }
  if (const auto model = reader.Find({"distortion_model"}))
    camera.model = ModelOf(model->second.Scalar(), reader.path, model->first);
  if (const auto found = reader.Find({"distortion_coeffs", "distortion_coefficients"}))
    SetDistortion(camera, reader.Numbers({"distortion_coeffs", "distortion_coefficients"}),
                  reader.path, found->first);
  return camera;
}

struct ColmapModel {
  const char* name;
  size_t focal_lengths;  // one or two, then cx cy
  size_t coefficients;   // k1 k2 p1 p2 k3 ..., or k1 .. k4 of a fisheye
  LensModel model;
};
constexpr ColmapModel kColmapModels[] = {{"SIMPLE_PINHOLE", 1, 0, LensModel::kPinhole},
                                         {"PINHOLE", 2, 0, LensModel::kPinhole},
                                         {"SIMPLE_RADIAL", 1, 1, LensModel::kPinhole},
                                         {"RADIAL", 1, 2, LensModel::kPinhole},
                                         {"OPENCV", 2, 4, LensModel::kPinhole},
                                         {"FULL_OPENCV", 2, 8, LensModel::kPinhole},
                                         {"SIMPLE_RADIAL_FISHEYE", 1, 1, LensModel::kFisheye},
                                         {"RADIAL_FISHEYE", 1, 2, LensModel::kFisheye},
                                         {"OPENCV_FISHEYE", 2, 4, LensModel::kFisheye}};

// "ID MODEL WIDTH HEIGHT PARAMS..."
Camera ReadColmapLine(const std::vector<std::string_view>& fields, const std::string& place) {
  const auto model = std::ranges::find(kColmapModels, fields[1], &ColmapModel::name);
  if (model == std::end(kColmapModels))
    throw InputError(fmt::format("{}: camera model \"{}\" is not supported", place, fields[1]));
  std::vector<double> values;
  for (size_t i = 2; i < fields.size(); ++i) {
    const auto value = ParseNumber(fields[i]);
    if (!value) throw InputError(fmt::format("{}: \"{}\", expected a number", place, fields[i]));
    values.push_back(*value);
  }
  const size_t expected = 4 + model->focal_lengths + model->coefficients;
  if (values.size() != expected)
    throw InputError(fmt::format("{}: {} numbers after {}, expected {}", place, values.size(),
                                 model->name, expected));
  const auto [width, height] = std::pair{values[0], values[1]};
  if (!(width >= 1 && width <= kMaxSide && height >= 1 && height <= kMaxSide))
    throw InputError(
        fmt::format("{}: image size {} x {}, allowed: 1 to {}", place, width, height, kMaxSide));
  Camera camera;
  camera.model = model->model;
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  const double* p = values.data() + 2;
  camera.fx = p[0];
  camera.fy = p[model->focal_lengths - 1];
  // COLMAP's pixel centres are at half integers, ours at integers.
  camera.cx = p[model->focal_lengths] - 0.5;
  camera.cy = p[model->focal_lengths + 1] - 0.5;
  std::vector<double> k(values.end() - static_cast<std::ptrdiff_t>(model->coefficients),
                        values.end());
  if (k.size() < 4) k.resize(4, 0.0);
  SetDistortion(camera, k, place, "distortion");
  return camera;
}

Camera ReadColmapKind(const std::string& text, const std::string& path,
                      const cv::Size& image_size) {
  std::vector<Camera> cameras;
  int line_number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++line_number;
    const auto fields = SplitFields(line);
    if (fields.empty() || fields[0][0] == '#') continue;
    const std::string place = fmt::format("{}:{}", path, line_number);
    if (fields.size() < 5)
      throw InputError(fmt::format("{}: expected ID MODEL WIDTH HEIGHT PARAMS", place));
    cameras.push_back(ReadColmapLine(fields, place));
  }
  if (cameras.size() == 1) return cameras[0];
  const auto fits = [&](const Camera& c) {
    return c.width == image_size.width && c.height == image_size.height;
  };
  if (std::ranges::count_if(cameras, fits) != 1)
    throw InputError(fmt::format("{}: holds {} cameras, expected exactly one for images of {} x {}",
                                 path, cameras.size(), image_size.width, image_size.height));
  return *std::ranges::find_if(cameras, fits);
}

// Whether the first line that is no comment starts with a number and a word in capitals.
bool IsColmap(const std::string& text) {
  for (const std::string_view line : SplitLines(text)) {
    const auto fields = SplitFields(line);
    if (fields.empty() || fields[0][0] == '#') continue;
    return fields.size() >= 2 && ParseNumber(fields[0]) &&
           std::ranges::all_of(fields[1],
                               [](char c) { return (c >= 'A' && c <= 'Z') || c == '_'; });
  }
  return false;
}

}  // namespace

Camera ReadCameraFile(const std::string& path, const cv::Size& image_size) {
  const std::string text = ReadTextFile(path);
  if (IsColmap(text)) return ReadColmapKind(text, path, image_size);
  const Reader reader{path, ParseYamlMapping(text, path)};
  if (reader.Find({"Camera.fx", "Camera1.fx"})) return ReadOrbSlamKind(reader);
  if (const auto cam0 = reader.Find({"cam0"}); cam0 && cam0->second.IsMap())
    return ReadKalibrKind({path, cam0->second, "cam0."});
  if (reader.Find({"intrinsics"})) return ReadKalibrKind(reader);
  if (reader.Find({"camera_matrix", "Camera_Matrix", "cameraMatrix", "CameraMatrix", "K", "k"}))
    return ReadMatrixKind(reader);
  throw InputError(
      fmt::format("{}: not a calibration; looked for camera_matrix (ROS, OpenCV), Camera.fx "
                  "(ORB-SLAM), cam0.intrinsics (Kalibr), ID MODEL (COLMAP)",
                  path));
}

}  // namespace oaslam
