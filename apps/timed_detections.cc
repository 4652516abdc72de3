#include "timed_detections.h"

#include <fmt/format.h>

#include <algorithm>

#include "oaslam/error.h"
#include "oaslam/formats/text.h"

namespace oaslam::apps {

std::vector<TimedDetections> SelectTimedDetections(const DetectionTable& table,
                                                   const std::string& path,
                                                   const CommonOptions& options) {
  std::vector<TimedDetections> images;
  bool stamped = true;
  for (const ImageDetections& image : table.images()) {
    const auto stamp = ParseNumber(WithoutExtension(BaseName(image.file_name)));
    stamped = stamped && stamp.has_value();
    images.push_back({0, stamp.value_or(0), image.file_name, image.detections});
  }
  // Frame numbers are numbers, too: only a number with a fraction is a time stamp.
  const auto has_fraction = [](const TimedDetections& image) {
    return WithoutExtension(BaseName(image.name)).find('.') != std::string::npos;
  };
  stamped = stamped && std::ranges::any_of(images, has_fraction);
  if (stamped)
    std::ranges::stable_sort(images, {}, &TimedDetections::timestamp);
  else
    std::ranges::stable_sort(images, {}, &TimedDetections::name);
  for (size_t i = 0; i < images.size(); ++i) {
    images[i].index = static_cast<int>(i);
    if (!stamped) images[i].timestamp = static_cast<double>(i) / options.fps.value_or(30);
  }
  const auto size = static_cast<int>(images.size());
  const int from = std::min(options.from, size),
            to = options.to < 0 ? size : std::min(options.to, size);
  if (from >= to)
    throw InputError(fmt::format("{}: no image within [{}, {}) of its {}", path, from, to, size));
  return {images.begin() + from, images.begin() + to};
}

}  // namespace oaslam::apps
