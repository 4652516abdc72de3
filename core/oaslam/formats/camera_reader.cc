#include "oaslam/formats/camera_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "oaslam/formats/text.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/printable.h"

namespace oaslam {
namespace {

// The numbers of a list, or of a list of rows.
YAML::Node Flat(const YAML::Node& list) {
  const auto is_row = [](const YAML::Node& row) { return row.IsSequence(); };
  if (!list.IsSequence() || list.size() == 0 || !std::all_of(list.begin(), list.end(), is_row))
    return list;
  YAML::Node flat(YAML::NodeType::Sequence);
  for (const YAML::Node& row : list)
    for (const YAML::Node& value : row) flat.push_back(value);
  return flat;
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
  throw BadInput("{}: XML, expected that of OpenCV's FileStorage (<opencv_storage>)", path);
}

// What is nested deeper than any calibration is left out.
YAML::Node NodeOf(const nlohmann::json& json, int depth = 0) {
  constexpr int kDeepest = 8;
  YAML::Node node;
  if (depth > kDeepest) return node;
  if (json.is_object()) {
    node = YAML::Node(YAML::NodeType::Map);
    for (const auto& [key, value] : json.items())
      // Poses and paths of images, of which there may be many, are not looked at.
      node[key] = key == "frames" ? YAML::Node(YAML::NodeType::Sequence) : NodeOf(value, depth + 1);
  } else if (json.is_array()) {
    node = YAML::Node(YAML::NodeType::Sequence);
    for (const auto& value : json) node.push_back(NodeOf(value, depth + 1));
  } else if (!json.is_null()) {
    node = json.is_string() ? json.get<std::string>() : json.dump();
  }
  return node;
}

// The keys of a camera that a frame of a transforms.json may have, instead of the whole file.
constexpr std::array kFrameKeys = {"camera_model", "is_fisheye", "fl_x", "fl_y", "cx",
                                   "cy",           "w",          "h",    "k1",   "k2",
                                   "k3",           "k4",         "p1",   "p2"};

void TakeCameraOfFrames(nlohmann::json& root, const std::string& path, const cv::Size& image_size) {
  if (!root.is_object() || root.contains("fl_x") || root.contains("camera_angle_x")) return;
  const auto frames = root.find("frames");
  if (frames == root.end() || !frames->is_array()) return;
  const auto is_side = [](const nlohmann::json& frame, const char* key, int side) {
    return side == 0 || !frame.contains(key) || frame[key] == side;
  };
  std::vector<std::pair<double, size_t>> focal_lengths;
  for (size_t i = 0; i < frames->size(); ++i) {
    const nlohmann::json& frame = (*frames)[i];
    if (frame.is_object() && frame.contains("fl_x") && frame["fl_x"].is_number() &&
        is_side(frame, "w", image_size.width) && is_side(frame, "h", image_size.height))
      focal_lengths.emplace_back(frame["fl_x"].get<double>(), i);
  }
  if (focal_lengths.empty()) return;
  std::ranges::sort(focal_lengths);
  const double least = focal_lengths.front().first, most = focal_lengths.back().first;
  constexpr double kBreathing = 0.02;  // what an autofocus changes; more is a zoom or another lens
  if (most > (1 + kBreathing) * least)
    Log(LogLevel::kWarning,
        "{}: the focal length of its frames is {:.1f} to {:.1f} px; one camera, that of the "
        "median, "
        "is taken for all",
        path, least, most);
  const nlohmann::json frame = (*frames)[focal_lengths[focal_lengths.size() / 2].second];
  for (const char* key : kFrameKeys)
    if (frame.contains(key)) root[key] = frame[key];
}

// JSON is nearly YAML, but blanks of any kind may stand in it.
YAML::Node ParseJsonCamera(const std::string& text, const std::string& path,
                           const cv::Size& image_size) {
  try {
    nlohmann::json root = nlohmann::json::parse(text);
    TakeCameraOfFrames(root, path, image_size);
    return NodeOf(root);
  } catch (const nlohmann::json::exception& error) {
    throw BadInput("{}: no JSON: {}", path, OnOneLine(Printable(error.what()), 200));
  }
}

}  // namespace

YAML::Node ParseCameraFile(const std::string& text, const std::string& path,
                           const cv::Size& image_size) {
  const std::string_view start = Trim(text);
  if (start.starts_with("<")) return ParseXml(text, path);
  if (path.ends_with(".json") && start.starts_with("{"))
    return ParseJsonCamera(text, path, image_size);
  return ParseYamlMapping(text, path);
}

std::optional<std::pair<std::string, YAML::Node>> CameraReader::Find(CameraKeys keys) const {
  for (const char* key : keys)
    if (const YAML::Node node = root[key]) return std::pair{prefix + key, node};
  return std::nullopt;
}

std::pair<std::string, YAML::Node> CameraReader::Need(CameraKeys keys) const {
  if (auto found = Find(keys)) return *found;
  throw BadInput("{}: key {}{} is missing", path, prefix, *keys.begin());
}

double CameraReader::Number(CameraKeys keys) const {
  const auto [key, node] = Need(keys);
  return YamlNumber(node, path, key);
}

double CameraReader::NumberOr(const std::string& key, double fallback) const {
  return Find({key.c_str()}) ? Number({key.c_str()}) : fallback;
}

std::vector<double> CameraReader::NumbersOf(CameraKeys keys, double fallback) const {
  std::vector<double> values;
  for (const char* key : keys) values.push_back(NumberOr(key, fallback));
  return values;
}

std::vector<double> CameraReader::Numbers(CameraKeys keys, size_t count) const {
  const auto [key, node] = Need(keys);
  auto values = node.IsMap() ? YamlNumbers(node["data"], path, key + ".data")
                             : YamlNumbers(Flat(node), path, key);
  if (count > 0 && values.size() != count)
    throw BadInput("{}: {}: {} values, expected {}", path, key, values.size(), count);
  return values;
}

std::string CameraReader::Text(CameraKeys keys) const {
  const auto [key, node] = Need(keys);
  return node.IsScalar() ? node.Scalar() : TextOfNode(node);
}

CameraReader CameraReader::Below(const char* key) const {
  const auto [name, node] = Need({key});
  if (!node.IsMap())
    throw BadInput("{}: {}: {}, expected \"key: value\" lines", path, name, TextOfNode(node));
  return {path, node, image_size, name + "."};
}

void CameraReader::ReadSize(Camera& camera, CameraKeys width, CameraKeys height) const {
  if (!Find(width) && !Find(height)) return;
  const auto [width_key, width_node] = Need(width);
  const auto [height_key, height_node] = Need(height);
  camera.width = YamlInteger(width_node, path, width_key, 1, kMaxSide);
  camera.height = YamlInteger(height_node, path, height_key, 1, kMaxSide);
}

void CameraReader::ReadSizeList(Camera& camera, const char* list) const {
  const auto found = Find({list});
  if (!found) return;
  const auto& [key, node] = *found;
  if (!node.IsSequence() || node.size() != 2)
    throw BadInput("{}: {}: {}, expected [width, height]", path, key, TextOfNode(node));
  camera.width = YamlInteger(node[0], path, key, 1, kMaxSide);
  camera.height = YamlInteger(node[1], path, key, 1, kMaxSide);
}

void CameraReader::ReadFocal(Camera& camera, CameraKeys fx, CameraKeys fy, CameraKeys cx,
                             CameraKeys cy) const {
  camera.fx = Number(fx), camera.fy = Number(fy), camera.cx = Number(cx), camera.cy = Number(cy);
}

void CameraReader::CheckKeys(std::string_view known, CameraKeys rest) const {
  const std::vector<std::string_view> keys = SplitFields(known);
  for (const auto& entry : root) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "";
    const auto begins = [&](const char* other) { return key.starts_with(other); };
    if (key == "mask") continue;  // ours (camera_mask)
    if (std::ranges::find(keys, key) != keys.end() || std::ranges::any_of(rest, begins)) continue;
    throw BadInput(
        "{}: {}{}: {}, a key that is not understood; known: {}. If it says nothing "
        "about lens and image size, remove the line",
        path, prefix, key, TextOfNode(entry.second), fmt::join(keys, ", "));
  }
}

void CameraReader::CheckZero(CameraKeys keys, const std::string& model) const {
  for (const char* key : keys)
    if (const double value = NumberOr(key, 0); value != 0)
      throw BadInput("{}: {}{}: {}, but the model {} has no {}", path, prefix, key, value, model,
                     key);
}

}  // namespace oaslam
