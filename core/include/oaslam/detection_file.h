#pragma once

#include <memory>
#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// The detections of one image.
struct ImageDetections {
  std::string file_name;
  std::vector<Detection> detections;  // in the order of the file
};

// The detections of many images. Find looks for the base name of an image with its extension first,
// then without; where several images have it, for the one in the same folder, of which either path
// may tell less. A table never changes; copies share its content:
//
//   const DetectionTable table = LoadDetections("detections.json");
//   while (const auto image = source->Next())
//     slam.Process({image->image, image->timestamp, table.Find(image->name)});
class OASLAM_API DetectionTable {
 public:
  // Where several images have the same name and folder, Find returns the first.
  explicit DetectionTable(std::vector<ImageDetections> images);
  // Makes a table without images.
  DetectionTable();
  // Shares the content. There is no move, which would leave a table without content.
  DetectionTable(const DetectionTable&) = default;
  // Shares the content, too.
  DetectionTable& operator=(const DetectionTable&) = default;
  // Empty when the image is not listed.
  const std::vector<Detection>& Find(const std::string& image_name) const;
  // All images, in the order of the file.
  const std::vector<ImageDetections>& images() const;

 private:
  struct Content;
  std::shared_ptr<const Content> content_;
};

// Reads OA-SLAM's JSON or COCO results (docs/formats.md). A few boxes that are not finite, inverted
// or absurd are left out, and counted in a warning. Throws InputError where the JSON is malformed,
// or where so many boxes are unusable that the file is probably in another format; the message
// names the first such box by file name and index.
OASLAM_API DetectionTable LoadDetections(const std::string& path);

// Writes OA-SLAM's JSON. Bytes of a file name that are not UTF-8 become U+FFFD. Throws InputError
// where the file cannot be written, or a score or a box has a number that is not finite.
OASLAM_API void SaveDetections(const std::string& path, const std::vector<ImageDetections>& images);

}  // namespace oaslam
