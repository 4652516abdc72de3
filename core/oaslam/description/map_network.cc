#include "oaslam/description/map_network.h"

#include <Eigen/Core>
#include <opencv2/imgproc.hpp>

namespace oaslam {
namespace {

constexpr int kStep = 32;       // sides of the network's input are multiples of the coarsest cell
constexpr int kWindow = 41;     // side of the square in which contrast is measured, pixels
constexpr float kFloor = 5.0F;  // grey values; a contrast below it is noise

int RoundedUp(int side) { return (side + kStep - 1) / kStep * kStep; }

// Builds a network for OpenCV layer by layer; each function returns the name of what it added.
class NetBuilder {
 public:
  explicit NetBuilder(const DescriptorLayers& layers) : layers_(layers) {}

  std::string Convolution(const std::string& name, const std::string& input) {
    const auto& shape = *std::ranges::find(kDescriptorLayers, name, &LayerShape::name);
    cv::dnn::LayerParams params = Kernel(shape.kernel, shape.stride, shape.outputs);
    params.set("bias_term", true);
    const LayerWeights& layer = LayerOf(layers_, name);
    params.blobs = {layer.weights, layer.biases};
    return Add(name, "Convolution", params, {input});
  }
  // With a ReLU.
  std::string Rectified(const std::string& name, const std::string& input) {
    cv::dnn::LayerParams params;
    return Add(name + "_relu", "ReLU", params, {Convolution(name, input)});
  }
  std::string Sum(const std::string& a, const std::string& b) {
    cv::dnn::LayerParams params;
    params.set("operation", "sum");
    return Add(a + "+" + b, "Eltwise", params, {a, b});
  }
  // As large again: even cells are copies, odd ones means of their neighbours, with zeros beyond
  // the right and lower end.
  std::string Doubled(const std::string& input) {
    constexpr int kChannels = 48;
    cv::dnn::LayerParams params = Kernel(3, 2, kChannels);
    params.set("group", kChannels);
    params.set("adj_h", 1);
    params.set("adj_w", 1);
    params.set("bias_term", false);
    cv::Mat weights(std::vector<int>{kChannels, 1, 3, 3}, CV_32F);
    const std::array<float, 9> tent{.25F, .5F, .25F, .5F, 1, .5F, .25F, .5F, .25F};
    for (int i = 0; i < kChannels; ++i) std::ranges::copy(tent, weights.ptr<float>(i));
    params.blobs = {weights};
    return Add(input + "_doubled", "Deconvolution", params, {input});
  }

  cv::dnn::Net Take() { return std::move(net_); }

 private:
  static cv::dnn::LayerParams Kernel(int side, int stride, int outputs) {
    cv::dnn::LayerParams params;
    params.set("kernel_size", side);
    params.set("stride", stride);
    params.set("pad", side / 2);
    params.set("num_output", outputs);
    return params;
  }
  std::string Add(const std::string& name, const std::string& type, cv::dnn::LayerParams& params,
                  const std::vector<std::string>& inputs) {
    params.name = name;
    params.type = type;
    const int id = net_.addLayer(name, type, params);
    for (size_t i = 0; i < inputs.size(); ++i)
      net_.connect(inputs[i].empty() ? 0 : net_.getLayerId(inputs[i]), 0, id, static_cast<int>(i));
    return name;
  }

  const DescriptorLayers& layers_;
  cv::dnn::Net net_;
};

constexpr const char* kFineOutput = "quarter_b_relu";
constexpr const char* kCoarseOutput = "coarse_relu";

cv::dnn::Net BuildNet(const DescriptorLayers& layers) {
  NetBuilder net(layers);
  const std::string input;  // the network's
  const std::string fine =
      net.Rectified("quarter_b", net.Rectified("quarter_a", net.Rectified("first", input)));
  std::string eighth = net.Rectified("eighth_a", fine);
  eighth = net.Sum(eighth, net.Rectified("eighth_b", eighth));
  std::string sixteenth = net.Rectified("sixteenth_a", eighth);
  sixteenth = net.Sum(sixteenth, net.Rectified("sixteenth_b", sixteenth));
  sixteenth = net.Sum(sixteenth, net.Rectified("sixteenth_c", sixteenth));
  const std::string mixed = net.Convolution("mix_32", net.Rectified("thirtysecond", sixteenth));
  sixteenth = net.Sum(net.Convolution("mix_16", sixteenth), net.Doubled(mixed));
  net.Rectified("coarse", net.Sum(eighth, net.Doubled(sixteenth)));
  return net.Take();
}

// Sums of the pixels and of their squares, as integers, over the window about each pixel. Beyond
// the border the image is mirrored about its outermost pixels.
void WindowSums(const cv::Mat& grey, cv::Mat& sums, cv::Mat& squares) {
  const cv::Size window(kWindow, kWindow);
  const cv::Point center(-1, -1);
  cv::boxFilter(grey, sums, CV_32S, window, center, false, cv::BORDER_REFLECT_101);
  cv::sqrBoxFilter(grey, squares, CV_32S, window, center, false, cv::BORDER_REFLECT_101);
}

}  // namespace

MapNetwork::MapNetwork(const DescriptorLayers& layers) : net_(BuildNet(layers)) {
  net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
}

void MapNetwork::FillInput(const cv::Mat& grey) {
  WindowSums(grey, sums_, squares_);
  const std::vector<int> shape{1, 1, RoundedUp(grey.rows), RoundedUp(grey.cols)};
  if (input_.dims != 4 || input_.size[2] != shape[2] || input_.size[3] != shape[3])
    input_.create(shape, CV_32F);
  input_.setTo(0);
  constexpr float kPart = 1.0F / (kWindow * kWindow);
  for (int y = 0; y < grey.rows; ++y) {
    using Ints = Eigen::Map<const Eigen::ArrayXi>;
    const Eigen::Map<const Eigen::Array<uint8_t, Eigen::Dynamic, 1>> pixels(grey.ptr(y), grey.cols);
    const Ints sum(sums_.ptr<int>(y), grey.cols), square(squares_.ptr<int>(y), grey.cols);
    const auto mean = sum.cast<float>() * kPart;
    const auto variance = square.cast<float>() * kPart - mean.square();
    Eigen::Map<Eigen::ArrayXf>(input_.ptr<float>(0, 0, y), grey.cols) =
        (pixels.cast<float>() - mean) / (variance.max(0.0F).sqrt() + kFloor);
  }
}

MapNetwork::Maps MapNetwork::Run(const cv::Mat& grey) {
  FillInput(grey);
  net_.setInput(input_);
  std::vector<cv::Mat> outputs;
  net_.forward(outputs, std::vector<cv::String>{kFineOutput, kCoarseOutput});
  return {{outputs[0], 4}, {outputs[1], 8}};
}

}  // namespace oaslam
