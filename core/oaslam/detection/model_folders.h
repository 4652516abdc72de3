#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace oaslam {

// The detector that "default" names: the smallest of the catalogue, which keeps up with a camera on
// a processor of two cores.
inline constexpr const char* kDefaultModel = "yolox_nano";

// Returns the file name of the detector `name`, which is NAME.onnx in every folder.
std::string FileOfModel(const std::string& name);
// Whether `text` can be the name of a detector: letters, digits and ".-_", beginning with a letter
// or a digit; not a name with ".onnx", which is a file, and neither "default" nor "none".
bool IsModelName(const std::string& text);

// The user's folder of models, where `oaslam models` puts them; nothing where the environment sets
// neither XDG_DATA_HOME nor HOME.
std::optional<std::filesystem::path> UserModelFolder();
// Where models are looked for, in this order: see FindDetectorModel (oaslam/detector.h). They need
// not exist.
std::vector<std::filesystem::path> ModelFolders();
// The file of a detector, in the first folder that has it; nothing where none has.
std::optional<std::filesystem::path> FindModel(const std::string& name);

}  // namespace oaslam
