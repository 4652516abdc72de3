#include "oaslam/description/weights_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "oaslam/error.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

static_assert(std::endian::native == std::endian::little, "the numbers of the file are copied");

constexpr std::string_view kMagic = "OASLDESC";
constexpr uint32_t kVersion = 1;
constexpr size_t kHeaderBytes = 20;       // magic, version, number of layers, a factor of training
constexpr size_t kLayerHeaderBytes = 32;  // name, four sizes
constexpr size_t kNameBytes = 16;
constexpr size_t kCrcBytes = 4;  // a CRC-32 at the end, for train/export.py

[[noreturn]] void Refuse(const std::string& why) {
  throw InputError("weights of the descriptor: " + why);
}

size_t WeightCount(const LayerShape& shape) {
  return size_t{1} * shape.outputs * shape.inputs * shape.kernel * shape.kernel;
}

size_t FileBytes() {
  size_t bytes = kHeaderBytes + kCrcBytes;
  for (const LayerShape& shape : kDescriptorLayers)
    bytes += kLayerHeaderBytes + 2 * (WeightCount(shape) + shape.outputs);
  return bytes;
}

uint32_t NumberAt(std::string_view file, size_t at) {
  uint32_t number = 0;
  std::memcpy(&number, file.substr(at).data(), sizeof number);
  return number;
}

void CheckFile(std::string_view file) {
  if (!file.starts_with(kMagic))
    Refuse(fmt::format("not a file of weights, which begins with {}", kMagic));
  if (file.size() < kHeaderBytes) Refuse("the file ends in its header");
  if (const uint32_t version = NumberAt(file, 8); version != kVersion)
    Refuse(
        fmt::format("the file is of version {}; this program reads version {}", version, kVersion));
  if (const uint32_t count = NumberAt(file, 12); count != kDescriptorLayers.size())
    Refuse(fmt::format("the file has {} layers, not {}", count, kDescriptorLayers.size()));
  if (file.size() != FileBytes())
    Refuse(fmt::format("the file has {} bytes, not {}", file.size(), FileBytes()));
}

void CheckLayer(std::string_view header, const LayerShape& shape) {
  std::string_view name = header.substr(0, kNameBytes);
  name = name.substr(0, name.find('\0'));
  const std::array<int, 4> expected{shape.outputs, shape.inputs, shape.kernel, shape.stride};
  std::array<int, 4> sizes;
  std::memcpy(sizes.data(), header.substr(kNameBytes).data(), sizeof sizes);
  if (name != shape.name || sizes != expected)
    Refuse(fmt::format("the file has a layer {} ({}) where {} ({}) belongs", name,
                       fmt::join(sizes, ", "), shape.name, fmt::join(expected, ", ")));
}

// The bytes of a file, taken from its beginning to its end.
class Halves {
 public:
  explicit Halves(std::string_view bytes) : left_(bytes) {}

  std::string_view Skip(size_t bytes) {
    const std::string_view skipped = left_.substr(0, bytes);
    left_.remove_prefix(bytes);
    return skipped;
  }
  // The next numbers, widened to floats.
  cv::Mat Take(const std::vector<int>& shape) {
    cv::Mat halves(shape, CV_16F), floats;
    const std::string_view bytes = Skip(2 * halves.total());
    std::memcpy(halves.data, bytes.data(), bytes.size());
    halves.convertTo(floats, CV_32F);
    return floats;
  }

 private:
  std::string_view left_;
};

}  // namespace

DescriptorLayers ReadDescriptorWeights(std::string_view file) {
  CheckFile(file);
  DescriptorLayers layers;
  Halves rest(file.substr(kHeaderBytes));
  for (size_t i = 0; i < layers.size(); ++i) {
    const LayerShape& shape = kDescriptorLayers[i];
    CheckLayer(rest.Skip(kLayerHeaderBytes), shape);
    layers[i].weights = rest.Take({shape.outputs, shape.inputs, shape.kernel, shape.kernel});
    layers[i].biases = rest.Take({1, shape.outputs});
  }
  return layers;
}

const LayerWeights& LayerOf(const DescriptorLayers& layers, std::string_view name) {
  const auto found = std::ranges::find(kDescriptorLayers, name, &LayerShape::name);
  OASLAM_CHECK(found != kDescriptorLayers.end());
  return layers[found - kDescriptorLayers.begin()];
}

}  // namespace oaslam
