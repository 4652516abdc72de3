#include "oaslam/detector.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "oaslam/detection/letterbox.h"
#include "oaslam/detection/mask_ellipse.h"
#include "oaslam/detection/network.h"
#include "oaslam/detection/onnx_info.h"
#include "oaslam/detection/yolo_output.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/read_file.h"

namespace oaslam {
namespace {

constexpr int kDefaultInputSize = 640;            // for which published YOLO models are trained
constexpr int kMaxInputSize = 4096;               // its activations take gigabytes
constexpr size_t kMaxOnnxFile = size_t{1} << 31;  // the largest message of Protocol Buffers

cv::Size InputSize(const std::string& path, const OnnxInfo& info, const DetectorOptions& options) {
  const std::vector<int64_t>& shape = info.input_shape;
  if (shape.size() != 4 || (shape[1] != 3 && shape[1] != 0))
    throw BadInput(
        "{}: not an image detector: its input has the shape [{}], asked for [1, 3, height, width]",
        path, fmt::join(shape, ", "));
  const auto choose = [&](int wanted, int64_t stored) {
    if (wanted > 0 && stored > 0 && wanted != stored)
      throw BadInput("{}: input size {} asked for, but the network is made for {}", path, wanted,
                     stored);
    return wanted > 0 ? wanted : stored > 0 ? stored : kDefaultInputSize;
  };
  const int64_t width = choose(options.input_size.width, shape[3]);
  const int64_t height = choose(options.input_size.height, shape[2]);
  if (width < 32 || height < 32 || width > kMaxInputSize || height > kMaxInputSize)
    throw BadInput("{}: input size {}x{}, allowed: 32 to {}", path, width, height, kMaxInputSize);
  return {static_cast<int>(width), static_cast<int>(height)};
}

std::vector<int> ShapeOf(const cv::Mat& tensor) {
  return {tensor.size.p, tensor.size.p + tensor.dims};
}

cv::Mat AsBgr(const cv::Mat& image) {
  const int channels = image.channels();
  if (image.empty() || image.dims != 2 || image.depth() != CV_8U ||
      (channels != 1 && channels != 3 && channels != 4))
    throw BadInput("image: {}x{} with {} channels of type {}, allowed: 8-bit grey, BGR or BGRA",
                   image.cols, image.rows, channels, cv::depthToString(image.depth()));
  if (channels == 3) return image;
  cv::Mat bgr;
  cv::cvtColor(image, bgr, channels == 1 ? cv::COLOR_GRAY2BGR : cv::COLOR_BGRA2BGR);
  return bgr;
}

}  // namespace

struct Detector::Impl {
  DetectorOptions options;
  std::unique_ptr<Network> network;
  cv::Size input_size;
  std::map<int, std::string> names;
  size_t output = 0;                 // index of the output with the boxes
  std::optional<size_t> prototypes;  // index of the output with the mask prototypes
  OutputFormat format;

  std::vector<cv::Mat> Forward(const cv::Mat& network_image, bool yolox) {
    return network->Run(cv::dnn::blobFromImage(network_image, yolox ? 1.0 : 1.0 / 255, cv::Size(),
                                               cv::Scalar(), !yolox));
  }

  // Finds the first output that has the form of a detector's.
  bool FindBoxes(const std::vector<cv::Mat>& outputs, bool end_to_end, int masks) {
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (outputs[i].dims == 0) continue;
      const auto found = RecognizeOutput(ShapeOf(outputs[i]), input_size, options.layout,
                                         static_cast<int>(names.size()), end_to_end, masks);
      if (!found) continue;
      output = i;
      format = *found;
      return true;
    }
    return false;
  }

  // Runs the network once to recognise its outputs.
  void Probe(const std::string& path, bool end_to_end) {
    const std::vector<cv::Mat> outputs =
        Forward(cv::Mat(input_size, CV_8UC3, cv::Scalar::all(114)), false);
    int masks = 0;
    for (size_t i = 0; i < outputs.size(); ++i)
      if (outputs[i].dims == 4 && outputs[i].size[0] == 1) {
        prototypes = i;
        masks = outputs[i].size[1];
      }
    if (masks > 0 && FindBoxes(outputs, end_to_end, masks)) return;
    prototypes.reset();
    if (FindBoxes(outputs, end_to_end, 0)) return;
    std::vector<std::string> shapes;
    for (const cv::Mat& tensor : outputs)
      shapes.push_back(fmt::format("[{}]", fmt::join(ShapeOf(tensor), ", ")));
    throw BadInput("{}: not a detector of layout '{}': outputs {} for an input of {}x{}", path,
                   ToString(options.layout), fmt::join(shapes, ", "), input_size.width,
                   input_size.height);
  }
};

std::unique_ptr<Detector> Detector::Load(const std::string& model, const DetectorOptions& options) {
  const std::string path = FindDetectorModel(model);
  const std::string bytes = ReadFile(path, kMaxOnnxFile);
  const std::optional<OnnxInfo> info = ParseOnnxInfo(bytes);
  if (!info) throw InputError(path + ": not an ONNX file, or a damaged one");
  auto impl = std::make_unique<Impl>();
  impl->options = options;
  impl->input_size = InputSize(path, *info, options);
  if (const auto names = info->metadata.find("names"); names != info->metadata.end())
    impl->names = ParseNamesMetadata(names->second);
  const auto end_to_end = info->metadata.find("end2end");
  try {
    impl->network = LoadNetwork(path, options.backend);
    impl->Probe(path, end_to_end != info->metadata.end() && end_to_end->second == "True");
  } catch (const NetworkError& error) {
    throw BadInput("{}: {}", path, error.what());
  }
  return std::unique_ptr<Detector>(new Detector(std::move(impl)));
}

Detector::Detector(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Detector::~Detector() = default;

std::vector<Detection> Detector::Detect(const cv::Mat& image) {
  const cv::Mat bgr = AsBgr(image);
  const bool yolox = impl_->format.layout == DetectorLayout::kYolox;
  const Letterbox letterbox = MakeLetterbox(bgr, impl_->input_size, !yolox);
  const std::vector<cv::Mat> outputs = impl_->Forward(letterbox.image, yolox);
  const cv::Mat& output = outputs[impl_->output];
  std::vector<Detection> found;
  for (const Candidate& candidate : JoinLabels(SuppressPerClass(
           DecodeOutput(output, impl_->format, impl_->input_size, impl_->options.min_score),
           impl_->options.max_iou))) {
    Detection d = candidate;
    d.box = FromLetterbox(letterbox, candidate.box, image.size());
    if (d.box.Area() <= 0) continue;
    if (impl_->prototypes)
      if (const auto ellipse = EllipseFromMask(
              outputs[*impl_->prototypes], MaskCoefficients(output, impl_->format, candidate.place),
              candidate.box, impl_->input_size))
        d.ellipse = FromLetterbox(letterbox, *ellipse);
    found.push_back(std::move(d));
  }
  return found;
}

DetectorLayout Detector::layout() const { return impl_->format.layout; }
cv::Size Detector::input_size() const { return impl_->input_size; }
int Detector::class_count() const { return impl_->format.classes; }
const std::map<int, std::string>& Detector::class_names() const { return impl_->names; }

}  // namespace oaslam
