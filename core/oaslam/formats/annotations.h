#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "oaslam/formats/detection_input.h"

namespace oaslam {

// Boxes in the files of tools for annotation, and in texts of detectors (docs/formats.md). All
// functions throw InputError, which begins with `path`, that of the file or folder.

// Numbers for the classes of files that name them.
class ClassNumbers {
 public:
  int Of(const std::string& name);
  ClassNames names() const;

 private:
  std::map<std::string, int> numbers_;
};

// Whether a JSON is of labelme, of one image; or of Label Studio, in its form JSON or JSON-MIN.
bool IsLabelme(const nlohmann::json& root);
bool IsLabelStudio(const nlohmann::json& root);
DetectionFile ReadLabelme(const nlohmann::json& root, const std::string& path);
DetectionFile ReadLabelStudio(const nlohmann::json& root, const std::string& path);

// A table whose header names its columns.
DetectionFile ReadDetectionCsv(const std::string& path);
// YOLO's texts or labelme's files, one for each image.
DetectionFile ReadDetectionFolder(const std::string& path);

}  // namespace oaslam
