#include "gravity_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "oaslam/error.h"
#include "oaslam/io/text.h"

namespace oaslam::apps {

GravityTrack GravityTrack::Load(const std::string& path) {
  GravityTrack track;
  const std::string text = ReadTextFile(path);
  int number = 0;
  for (const std::string_view line : SplitLines(text)) {
    ++number;
    const std::string_view content = Trim(line);
    if (content.empty() || content.front() == '#') continue;
    std::vector<double> values;
    for (const std::string_view field : SplitFields(content))
      if (const auto value = ParseNumber(field)) values.push_back(*value);
    const bool valid = values.size() == 4 && SplitFields(content).size() == 4;
    if (!valid || Eigen::Vector3d(values[1], values[2], values[3]).norm() == 0)
      throw InputError(fmt::format("{}:{}: expected \"timestamp gx gy gz\", not all zero", path, number));
    track.samples_.push_back({values[0], {values[1], values[2], values[3]}});
  }
  std::ranges::stable_sort(track.samples_, {}, &Sample::timestamp);
  return track;
}

std::optional<Eigen::Vector3d> GravityTrack::At(double timestamp) const {
  constexpr double kMaxTimeDifference = 0.020;  // seconds
  const auto nearest = std::ranges::min_element(samples_, {}, [&](const Sample& s) { return std::abs(s.timestamp - timestamp); });
  if (nearest == samples_.end() || std::abs(nearest->timestamp - timestamp) > kMaxTimeDifference) return std::nullopt;
  return nearest->in_cam;
}

}  // namespace oaslam::apps
