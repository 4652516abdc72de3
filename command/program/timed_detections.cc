#include "timed_detections.h"

#include <algorithm>

#include "oaslam/formats/time_unit.h"
#include "oaslam/images/image_files.h"
#include "oaslam/util/bad_input.h"

namespace oaslam::apps {

std::vector<TimedDetections> SelectTimedDetections(const DetectionTable& table,
                                                   const std::string& path,
                                                   const CommonOptions& options) {
  std::vector<TimedDetections> images;
  std::vector<std::string> names;
  for (const ImageDetections& image : table.images()) {
    names.push_back(image.file_name);
    images.push_back({0, 0, image.file_name, image.detections});
  }
  const auto times = TimesOfNames(names, SecondsInUnit(options.time_unit));
  const bool stamped = times.has_value();
  for (size_t i = 0; stamped && i < images.size(); ++i) images[i].timestamp = times->seconds[i];
  if (stamped)
    std::ranges::stable_sort(images, {}, &TimedDetections::timestamp);
  else
    std::ranges::stable_sort(images, NaturalLess, &TimedDetections::name);
  for (size_t i = 0; i < images.size(); ++i) {
    images[i].index = static_cast<int>(i);
    if (!stamped) images[i].timestamp = static_cast<double>(i) / options.fps.value_or(30);
  }
  const auto size = static_cast<int>(images.size());
  const int from = std::min(options.from, size),
            to = options.to < 0 ? size : std::min(options.to, size);
  if (from >= to) throw BadInput("{}: no image within [{}, {}) of its {}", path, from, to, size);
  return {images.begin() + from, images.begin() + to};
}

}  // namespace oaslam::apps
