#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string_view>

namespace oaslam {

// A layer of the descriptor's network: a convolution, or (the two of the head) a matrix.
struct LayerShape {
  std::string_view name;
  int outputs = 0, inputs = 0;
  int kernel = 1;  // side, pixels
  int stride = 1;
};

// The layers in the order of the file.
constexpr std::array<LayerShape, 14> kDescriptorLayers{{
    {"first", 8, 1, 3, 2},
    {"quarter_a", 16, 8, 3, 2},
    {"quarter_b", 24, 16, 3, 1},
    {"eighth_a", 48, 24, 3, 2},
    {"eighth_b", 48, 48, 3, 1},
    {"sixteenth_a", 48, 48, 3, 2},
    {"sixteenth_b", 48, 48, 3, 1},
    {"sixteenth_c", 48, 48, 3, 1},
    {"thirtysecond", 48, 48, 3, 2},
    {"mix_32", 48, 48, 1, 1},
    {"mix_16", 48, 48, 1, 1},
    {"coarse", 64, 48, 3, 1},
    {"head_a", 160, 88, 1, 1},
    {"head_b", 64, 160, 1, 1},
}};

struct LayerWeights {
  cv::Mat weights;  // floats, outputs x inputs x kernel x kernel
  cv::Mat biases;   // floats, 1 x outputs
};

using DescriptorLayers = std::array<LayerWeights, kDescriptorLayers.size()>;

// Reads a file of weights, whose layout train/export.py describes. Throws InputError where it is
// another file, or of another version or network.
DescriptorLayers ReadDescriptorWeights(std::string_view file);

// The layer of this name, which must be one of kDescriptorLayers.
const LayerWeights& LayerOf(const DescriptorLayers& layers, std::string_view name);

}  // namespace oaslam
