#include "oaslam/formats/camera_mask.h"

#include <filesystem>

#include "oaslam/formats/camera_reader.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

namespace {

// The mapping that a calibration is; an empty one where it is none.
YAML::Node MappingOf(const std::string& path) {
  try {
    return ParseCameraFile(ReadTextFile(path), path);
  } catch (const InputError&) {  // LoadCamera tells what it is
    return YAML::Node(YAML::NodeType::Map);
  }
}

// The mask of the camera that is read of the file.
YAML::Node MaskIn(const YAML::Node& root) {
  for (const char* key : {"Camera.mask", "Camera1.mask"})
    if (root[key]) return root[key];
  for (const char* key : {"cam0", "Camera"})
    if (root[key] && root[key].IsMap() && root[key]["mask"]) return root[key]["mask"];
  const YAML::Node cameras = root["cameras"];
  if (cameras && cameras.IsSequence() && cameras.size() > 0 && cameras[0].IsMap() &&
      cameras[0]["mask"])
    return cameras[0]["mask"];
  return root["mask"];
}

}  // namespace

std::string MaskOfCalibration(const std::string& spec) {
  const std::filesystem::path path(spec);
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return "";
  const YAML::Node root = MappingOf(spec), mask = MaskIn(root);
  if (!mask) return "";
  if (!mask.IsScalar() || mask.Scalar().empty())
    throw BadInput("{}: mask: {}, allowed: the path of an image", spec, TextOfNode(mask));
  return (path.parent_path() / mask.Scalar()).lexically_normal().string();
}

}  // namespace oaslam
