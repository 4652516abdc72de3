#include "oaslam/formats/camera_mask.h"

#include <fmt/format.h>

#include <filesystem>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"
#include "oaslam/formats/yaml.h"

namespace oaslam {

std::string MaskOfCalibration(const std::string& spec) {
  const std::filesystem::path path(spec);
  std::error_code error;
  const bool is_yaml = path.extension() == ".yaml" || path.extension() == ".yml";
  if (!is_yaml || !std::filesystem::is_regular_file(path, error)) return "";
  const YAML::Node root = ParseYamlMapping(ReadTextFile(spec), spec);
  const YAML::Node first = root["cam0"];
  const YAML::Node mask = first && first.IsMap() ? first["mask"] : root["mask"];
  if (!mask) return "";
  if (!mask.IsScalar() || mask.Scalar().empty())
    throw InputError(
        fmt::format("{}: mask: {}, allowed: the path of an image", spec, TextOfNode(mask)));
  return (path.parent_path() / mask.Scalar()).lexically_normal().string();
}

}  // namespace oaslam
