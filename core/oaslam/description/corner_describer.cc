#include "oaslam/description/corner_describer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "oaslam/description/map_network.h"
#include "oaslam/description/weights_file.h"
#include "oaslam/util/check.h"

namespace oaslam {
namespace {

constexpr int kOctaves = 3;
constexpr uint64_t kBitsOfAWord = 64;  // of a descriptor; also the network's number of values

using RowMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// A layer of the head: for all corners at once, each a column.
struct HeadLayer {
  RowMatrix weights;
  Eigen::VectorXf biases;

  HeadLayer(const DescriptorLayers& layers, std::string_view name) {
    const auto& [weight_blob, bias_blob] = LayerOf(layers, name);
    weights = Eigen::Map<const RowMatrix>(weight_blob.ptr<float>(), weight_blob.size[0],
                                          weight_blob.size[1]);
    biases = Eigen::Map<const Eigen::VectorXf>(bias_blob.ptr<float>(), bias_blob.cols);
  }
  RowMatrix operator()(const RowMatrix& inputs) const {
    RowMatrix outputs(weights.rows(), inputs.cols());
    outputs.noalias() = weights * inputs;
    outputs.colwise() += biases;
    return outputs;
  }
};

// A corner in the octave in which it is described.
struct OctaveCorner {
  Eigen::Index index = 0;  // in the list of all corners
  Eigen::Vector2f px;      // in the octave
};

// Between which cells of a map a corner lies.
struct CellSample {
  size_t offset = 0;          // of the upper left of the four cells, in a channel
  float right = 0, down = 0;  // shares of the cells at the right, and of those below
};

// The lower of the two cells between which a coordinate lies, and the share of the upper. Beyond
// the border it is at the border; also what is not a number.
std::pair<int, float> Between(float cell, int cells) {
  const float clamped = cell > 0 ? std::min(cell, static_cast<float>(cells - 1)) : 0.0F;
  const int lower = std::min(static_cast<int>(clamped), cells - 2);
  return {lower, clamped - static_cast<float>(lower)};
}

CellSample SampleAt(const CellMap& map, const Eigen::Vector2f& px) {
  const Eigen::Vector2f cell = px / static_cast<float>(map.cell_px);
  const auto [x, right] = Between(cell.x(), map.columns());
  const auto [y, down] = Between(cell.y(), map.rows());
  return {size_t{1} * y * map.columns() + x, right, down};
}

// Interpolates a map at corners: a row of `features` for each channel, from `first_row`, and in it
// the column of each corner.
void SampleMap(const CellMap& map, std::span<const OctaveCorner> corners, Eigen::Index first_row,
               RowMatrix& features) {
  std::vector<CellSample> samples;
  samples.reserve(corners.size());
  for (const OctaveCorner& corner : corners) samples.push_back(SampleAt(map, corner.px));
  for (int channel = 0; channel < map.channels(); ++channel) {
    const float* plane = map.values.ptr<float>(0, channel);
    float* row = features.row(first_row + channel).data();
    for (size_t i = 0; i < samples.size(); ++i) {
      const CellSample& s = samples[i];
      const float* upper = plane + s.offset;
      const float* lower = upper + map.columns();
      const float above = upper[0] + s.right * (upper[1] - upper[0]);
      const float below = lower[0] + s.right * (lower[1] - lower[0]);
      row[corners[i].index] = above + s.down * (below - above);
    }
  }
}

// The octave whose pixels are nearest in size to those of the corner's level, by ratio.
int OctaveOf(float scale) {
  OASLAM_CHECK(scale > 0);
  return static_cast<int>(std::clamp(std::nearbyint(std::log2(scale)), 0.0F, kOctaves - 1.0F));
}

// From an image to one of half its size, whose pixels are means of 2 x 2.
Eigen::Vector2f Halved(const Eigen::Vector2f& px) { return (px.array() - 0.5F) / 2; }
cv::Mat Halved(const cv::Mat& grey) {
  const cv::Size size(grey.cols / 2, grey.rows / 2);
  cv::Mat half;
  cv::resize(grey(cv::Rect({0, 0}, size * 2)), half, size, 0, 0, cv::INTER_AREA);
  return half;
}

// The corners of each octave. An image too small to be halved is the last octave.
std::array<std::vector<OctaveCorner>, kOctaves> ByOctave(std::span<const ScaledCorner> corners,
                                                         int octaves) {
  std::array<std::vector<OctaveCorner>, kOctaves> sorted;
  for (size_t i = 0; i < corners.size(); ++i) {
    const int octave = std::min(OctaveOf(corners[i].scale), octaves - 1);
    OctaveCorner corner{static_cast<Eigen::Index>(i), corners[i].px};
    for (int k = 0; k < octave; ++k) corner.px = Halved(corner.px);
    sorted[octave].push_back(corner);
  }
  return sorted;
}

int OctaveCount(const GreyImage& image) {
  const int side = std::min(image.width, image.height);
  return std::clamp(static_cast<int>(std::log2(side)) + 1, 1, kOctaves);
}

// The network's values turned four times: 256 numbers whose signs are the descriptor's bits (random
// hyperplanes, Charikar 2002), since the share of signs that differ is the angle between two
// descriptors over pi. The first 64 are the values; three other turns are by products H S H T of a
// Hadamard matrix and signs. The same as `bits` of train/net.py.
HeadLayer Turned(const HeadLayer& head) {
  constexpr std::array<uint64_t, 4> kSigns{0x243F6A8885A308D3, 0x13198A2E03707344,
                                           0xA4093822299F31D0, 0x082EFA98EC4E6C89};  // of pi
  const auto hadamard = [](const RowMatrix& rows) {
    RowMatrix mixed = RowMatrix::Zero(rows.rows(), rows.cols());
    for (uint64_t i = 0; i < kBitsOfAWord; ++i)
      for (uint64_t j = 0; j < kBitsOfAWord; ++j)
        mixed.row(i) += (std::popcount(i & j) % 2 == 0 ? 1.0F : -1.0F) * rows.row(j);
    return mixed;
  };
  const auto with_signs = [](RowMatrix rows, uint64_t signs) {
    for (uint64_t i = 0; i < kBitsOfAWord; ++i)
      if (signs >> i & 1) rows.row(i) *= -1;
    return rows;
  };
  HeadLayer turned = head;
  turned.weights.resize(kSigns.size() * kBitsOfAWord, head.weights.cols());
  turned.biases.resize(kSigns.size() * kBitsOfAWord);
  for (size_t word = 0; word < kSigns.size(); ++word) {
    const auto turn = [&](const RowMatrix& rows) {
      return word == 0 ? rows
                       : hadamard(with_signs(hadamard(with_signs(rows, kSigns[word])), kSigns[0]));
    };
    turned.weights.middleRows(word * kBitsOfAWord, kBitsOfAWord) = turn(head.weights);
    turned.biases.segment(word * kBitsOfAWord, kBitsOfAWord) = turn(head.biases);
  }
  return turned;
}

// From a column of 256 numbers.
Descriptor SignsOf(const Eigen::VectorXf& values) {
  Descriptor bits{};
  for (uint64_t i = 0; i < bits.size() * kBitsOfAWord; ++i)
    if (values[i] > 0) bits[i / kBitsOfAWord] |= uint64_t{1} << i % kBitsOfAWord;
  return bits;
}

// The view of OpenCV, which does not write to it.
cv::Mat MatOf(const GreyImage& image) {
  return {image.height, image.width, CV_8UC1, const_cast<uint8_t*>(image.data),
          static_cast<size_t>(image.step)};
}

}  // namespace

class CornerDescriber::Impl {
 public:
  explicit Impl(const DescriptorLayers& layers)
      : networks_{MapNetwork(layers), MapNetwork(layers), MapNetwork(layers)},
        head_a_(layers, "head_a"),
        head_b_(Turned({layers, "head_b"})) {}

  std::vector<Descriptor> Describe(const GreyImage& image, std::span<const ScaledCorner> corners) {
    std::vector<Descriptor> descriptors(corners.size());
    const RowMatrix hidden = head_a_(FeaturesAt(image, corners)).cwiseMax(0.0F);
    const Eigen::MatrixXf values = head_b_(hidden);
    for (size_t i = 0; i < corners.size(); ++i)
      descriptors[i] = SignsOf(values.col(static_cast<Eigen::Index>(i)));
    return descriptors;
  }

 private:
  // What the maps of the octaves have at the corners, each a column.
  RowMatrix FeaturesAt(const GreyImage& image, std::span<const ScaledCorner> corners) {
    RowMatrix features(MapNetwork::kFineChannels + MapNetwork::kCoarseChannels,
                       static_cast<Eigen::Index>(corners.size()));
    const auto sorted = ByOctave(corners, OctaveCount(image));
    const auto last = std::ranges::find_if(sorted.rbegin(), sorted.rend(),
                                           [](const auto& mine) { return !mine.empty(); });
    cv::Mat octave = MatOf(image);
    for (auto mine = sorted.begin(); mine != last.base(); ++mine) {
      if (mine != sorted.begin()) octave = Halved(octave);
      if (mine->empty()) continue;
      const MapNetwork::Maps maps = networks_[mine - sorted.begin()].Run(octave);
      SampleMap(maps.fine, *mine, 0, features);
      SampleMap(maps.coarse, *mine, MapNetwork::kFineChannels, features);
    }
    return features;
  }

  std::array<MapNetwork, kOctaves> networks_;  // one each, so that its buffers fit
  HeadLayer head_a_, head_b_;
};

CornerDescriber::CornerDescriber(std::string_view weights)
    : impl_(std::make_unique<Impl>(ReadDescriptorWeights(weights))) {}

CornerDescriber::~CornerDescriber() = default;
CornerDescriber::CornerDescriber(CornerDescriber&&) noexcept = default;
CornerDescriber& CornerDescriber::operator=(CornerDescriber&&) noexcept = default;

std::vector<Descriptor> CornerDescriber::Describe(const GreyImage& image,
                                                  std::span<const ScaledCorner> corners) {
  if (corners.empty()) return {};
  OASLAM_CHECK(image.width > 0 && image.height > 0);
  try {
    return impl_->Describe(image, corners);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw std::bad_alloc();
    throw std::runtime_error(
        fmt::format("OpenCV {} cannot describe corners: {}", CV_VERSION, error.err));
  }
}

}  // namespace oaslam
