#include "oaslam/service/received_features.h"

#include <bit>
#include <cstring>

#include "oaslam/util/bad_input.h"

namespace oaslam {

std::vector<ImageFeature> ReadReceivedFeatures(std::string_view bytes, int count) {
  static_assert(std::endian::native == std::endian::little);
  constexpr size_t kPlace = 3 * sizeof(float), kDescriptor = sizeof(ImageFeature::descriptor);
  const auto number = static_cast<size_t>(count);
  const size_t length = number * (kPlace + 1 + kDescriptor);
  if (bytes.size() != length)
    throw BadInput("features: {} bytes, expected {} of {} key points", bytes.size(), length, count);
  std::vector<ImageFeature> features(number);
  const char* places = bytes.data();
  const char* levels = places + number * kPlace;
  const char* descriptors = levels + number;
  for (size_t i = 0; i < number; ++i) {
    float place[3];
    std::memcpy(place, places + i * kPlace, kPlace);
    features[i].pixel = {place[0], place[1]};
    features[i].angle_rad = place[2];
    features[i].level = static_cast<uint8_t>(levels[i]);
    std::memcpy(features[i].descriptor.data(), descriptors + i * kDescriptor, kDescriptor);
  }
  return features;
}

}  // namespace oaslam
