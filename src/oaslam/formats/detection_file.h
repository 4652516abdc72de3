#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <unordered_map>
#include <vector>

#include "oaslam/types.h"

namespace oaslam {

struct ImageDetections {
  std::string file_name;
  std::vector<Detection> detections;  // in the order of the file
};

// Detections of many images, found by base name: with extension first, then without.
class DetectionTable {
 public:
  explicit DetectionTable(std::vector<ImageDetections> images);
  DetectionTable() = default;
  // Empty when the image is not listed.
  const std::vector<Detection>& Find(const std::string& image_name) const;
  const std::vector<ImageDetections>& images() const { return images_; }

 private:
  std::vector<ImageDetections> images_;
  std::unordered_map<std::string, size_t> by_name_, by_stem_;
};

// Reads OA-SLAM's JSON or COCO results (docs/formats.md). Throws InputError: malformed JSON, or an
// entry with a NaN, inverted or absurd box, named by file name and index.
DetectionTable LoadDetections(const std::string& path);

// The detections of one image, a list as in OA-SLAM's JSON. `where`: what the list is, for
// messages. Throws InputError.
std::vector<Detection> DetectionsFromJson(const nlohmann::json& list, const std::string& where);

// Writes OA-SLAM's JSON.
void SaveDetections(const std::string& path, const std::vector<ImageDetections>& images);

}  // namespace oaslam
