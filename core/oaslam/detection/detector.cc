#include "oaslam/detector.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <mutex>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>
#include <utility>

#include "oaslam/detection/layout_check.h"
#include "oaslam/detection/letterbox.h"
#include "oaslam/detection/mask_ellipse.h"
#include "oaslam/detection/network.h"
#include "oaslam/detection/onnx_info.h"
#include "oaslam/detection/yolo_output.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/read_file.h"

namespace oaslam {
namespace {

constexpr int kDefaultInputSize = 640;  // for which published YOLO models are trained
constexpr int kMaxInputSize = 4096;     // its activations take gigabytes
constexpr char kLayoutNames[] = "yolox, yolov5, yolov8, end2end, rtdetr";
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

// "[1, 84, 8400]"
std::string ShapeText(const cv::Mat& tensor) {
  return fmt::format("[{}]", fmt::join(tensor.size.p, tensor.size.p + tensor.dims, ", "));
}

// What a network without a detector's output probably is, for the end of a message.
std::string KindOf(const std::vector<cv::Mat>& outputs, const std::string& task) {
  const auto all = [&](auto is) { return std::ranges::all_of(outputs, is); };
  const bool has_boxes_alone = std::ranges::any_of(
      outputs, [](const cv::Mat& o) { return o.dims > 1 && o.size[o.dims - 1] == 4; });
  std::string kind;
  if (outputs.size() > 1 && has_boxes_alone)
    kind = "boxes and scores in outputs of their own, which are not read";
  else if (all([](const cv::Mat& o) { return o.dims == 4 || o.dims == 5; }))
    kind = "a segmentation without boxes, or grids that are not decoded";
  else if (all([](const cv::Mat& o) { return o.dims == 2 && o.size[0] == 1; }))
    kind = "a classification, or boxes in rows that are not read";
  if (!task.empty()) kind += (kind.empty() ? "" : "; ") + fmt::format("task '{}'", task);
  return kind.empty() ? "" : " (" + kind + ")";
}

Fit FitOf(DetectorLayout layout) {
  if (layout == DetectorLayout::kRtDetr) return Fit::kStretched;
  return layout == DetectorLayout::kYolox ? Fit::kTopLeft : Fit::kCentered;
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

struct OASLAM_LOCAL Detector::Impl {
  std::string path;
  DetectorOptions options;
  std::unique_ptr<Network> network;
  cv::Size input_size;
  HeadMetadata head;
  size_t output = 0;                 // index of the output with the boxes
  std::optional<size_t> prototypes;  // index of the output with the mask prototypes
  OutputFormat format;
  cv::Size recognized;  // of the output: numbers of a candidate, candidates
  LayoutCheck check;

  std::vector<cv::Mat> Forward(const cv::Mat& network_image) {
    const bool is_yolox = format.layout == DetectorLayout::kYolox;
    return network->Run(cv::dnn::blobFromImage(network_image, is_yolox ? 1.0 : 1.0 / 255,
                                               cv::Size(), cv::Scalar(), !is_yolox));
  }

  cv::Size SizeOf(const cv::Mat& tensor) const {
    const Candidates candidates = CandidatesOf(tensor, format);
    return {candidates.numbers, candidates.count};
  }

  // Finds the first output that has the form of a detector's.
  bool FindBoxes(const std::vector<cv::Mat>& outputs, int masks) {
    for (size_t i = 0; i < outputs.size(); ++i) {
      if (outputs[i].dims == 0) continue;
      const auto found = RecognizeOutput(outputs[i], input_size, options.layout, head, masks);
      if (!found) continue;
      output = i;
      format = *found;
      recognized = SizeOf(outputs[i]);
      return true;
    }
    return false;
  }

  // Runs the network once to recognise its outputs.
  void Probe() {
    const std::vector<cv::Mat> outputs =
        Forward(cv::Mat(input_size, CV_8UC3, cv::Scalar::all(114)));
    int masks = 0;
    for (size_t i = 0; i < outputs.size(); ++i)
      if (outputs[i].dims == 4 && outputs[i].size[0] == 1) {
        prototypes = i;
        masks = outputs[i].size[1];
      }
    if (masks == 0 || !FindBoxes(outputs, masks)) {
      prototypes.reset();
      if (!FindBoxes(outputs, 0)) {
        std::vector<std::string> shapes;
        for (const cv::Mat& tensor : outputs) shapes.push_back(ShapeText(tensor));
        throw BadInput("{}: not a detector of layout '{}': outputs {} for an input of {}x{}{}",
                       path, ToString(options.layout), fmt::join(shapes, ", "), input_size.width,
                       input_size.height, KindOf(outputs, head.task));
      }
    }
    Check(outputs[output], {});  // a grey image may show anything but objects
  }

  // Throws InputError where the output has another layout.
  void Check(const cv::Mat& tensor, const std::vector<Candidate>& candidates) {
    const std::string problem = check.Add(tensor, format, input_size, candidates);
    if (problem.empty()) return;
    throw BadInput(
        "{}: its output {} was taken for layout '{}'{}, but gives {}; it is another kind of "
        "network, or its layout has to be given ({})",
        path, ShapeText(tensor), ToString(format.layout),
        format.classes > 0 ? fmt::format(" of {} classes", format.classes) : "", problem,
        kLayoutNames);
  }

  std::vector<Candidate> Decode(const cv::Mat& tensor) {
    const cv::Size size = SizeOf(tensor);
    if (size.width != recognized.width || (!IsListed(format) && size.height != recognized.height))
      throw BadInput("{}: its output had {} rows of {} numbers, and now is {}", path,
                     recognized.height, recognized.width, ShapeText(tensor));
    std::vector<Candidate> found = DecodeCandidates(tensor, format, input_size, options.min_score);
    Check(tensor, found);
    std::erase_if(found, [](const Candidate& candidate) { return !IsUsable(candidate); });
    // Networks of 8 bits round up.
    for (Candidate& candidate : found) {
      candidate.score = std::min(candidate.score, 1.0);
      for (Label& label : candidate.other_labels) label.score = std::min(label.score, 1.0);
    }
    return found;
  }

  void SayWhatIsLeftOut() const {
    const char* const left_out = head.task == "pose" ? "keypoints: its boxes alone are used"
                                 : head.task == "obb"
                                     ? "oriented boxes: the upright boxes around them are used"
                                     : nullptr;
    if (left_out == nullptr) return;
    // Programs load several copies of a network.
    static std::mutex mutex;
    static std::set<std::string> said;
    const std::lock_guard lock(mutex);
    if (said.insert(path).second) Log(LogLevel::kInfo, "{}: a network for {}", path, left_out);
  }
};

std::unique_ptr<Detector> Detector::Load(const std::string& model, const DetectorOptions& options) {
  const std::string path = FindDetectorModel(model);
  const std::string bytes = ReadFile(path, kMaxOnnxFile);
  const std::optional<OnnxInfo> info = ParseOnnxInfo(bytes);
  if (!info) throw InputError(path + ": not an ONNX file, or a damaged one");
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->options = options;
  impl->input_size = InputSize(path, *info, options);
  impl->head = ParseHeadMetadata(info->metadata);
  if (impl->head.task == "classify")
    throw BadInput("{}: a classification network (task 'classify' in its metadata), not a detector",
                   path);
  try {
    impl->network = LoadNetwork(path, options.backend);
    impl->Probe();
  } catch (const NetworkError& error) {
    throw BadInput("{}: {}", path, error.what());
  }
  impl->SayWhatIsLeftOut();
  return std::unique_ptr<Detector>(new Detector(std::move(impl)));
}

Detector::Detector(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Detector::~Detector() = default;

std::vector<Detection> Detector::Detect(const cv::Mat& image) {
  const cv::Mat bgr = AsBgr(image);
  const Letterbox letterbox = MakeLetterbox(bgr, impl_->input_size, FitOf(impl_->format.layout));
  const std::vector<cv::Mat> outputs = impl_->Forward(letterbox.image);
  const cv::Mat& output = outputs[impl_->output];
  std::vector<Detection> found;
  for (const Candidate& candidate :
       JoinLabels(SuppressPerClass(impl_->Decode(output), impl_->options.max_iou))) {
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
const std::map<int, std::string>& Detector::class_names() const { return impl_->head.names; }

}  // namespace oaslam
