#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// The detections of an image.
struct ImageDetections {
  std::string file_name;
  std::vector<Detection> detections;  // in the order of the file
};

// Detections of many images, found by base name: with extension first, then without.
class OASLAM_API DetectionTable {
 public:
  explicit DetectionTable(std::vector<ImageDetections> images);
  DetectionTable() = default;
  // Empty when the image is not listed.
  const std::vector<Detection>& Find(const std::string& image_name) const;
  // All of them, in the order of the file.
  const std::vector<ImageDetections>& images() const { return images_; }

 private:
  std::vector<ImageDetections> images_;
  std::unordered_map<std::string, size_t> by_name_, by_stem_;
};

// Reads OA-SLAM's JSON or COCO results (docs/formats.md). Throws InputError: malformed JSON, or an
// entry with a NaN, inverted or absurd box, named by file name and index.
OASLAM_API DetectionTable LoadDetections(const std::string& path);

// Writes OA-SLAM's JSON.
OASLAM_API void SaveDetections(const std::string& path, const std::vector<ImageDetections>& images);

}  // namespace oaslam
