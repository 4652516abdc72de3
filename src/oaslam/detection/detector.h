#pragma once

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/detection/network.h"
#include "oaslam/detection/yolo_output.h"
#include "oaslam/types.h"

namespace oaslam {

struct DetectorOptions {
  double min_score = 0.2;  // detections at or below are dropped
  double max_iou = 0.45;   // of two boxes of a class with more overlap, the weaker one is dropped
  // Input size of the network; {0, 0}: that of the file, or 640x640 where the file leaves it open.
  cv::Size input_size{};
  // kAuto: recognised by shape and metadata; docs/formats.md tells which cases are ambiguous.
  DetectorLayout layout = DetectorLayout::kAuto;
  NetworkBackend backend = NetworkBackend::kAuto;
};

// An object detector of the YOLO family in an ONNX file, run on the CPU. One image at a time: not
// thread-safe.
class Detector {
 public:
  // Throws InputError where the file is missing, is no ONNX file, or its network is no detector,
  // does not have the requested layout, or cannot be run by the requested library.
  static std::unique_ptr<Detector> Load(const std::string& path,
                                        const DetectorOptions& options = {});
  ~Detector();

  // Detects objects in an 8-bit image (BGR or grey). Boxes are in its pixels,
  // clipped to it, best first.
  std::vector<Detection> Detect(const cv::Mat& image);

  DetectorLayout layout() const;
  cv::Size input_size() const;
  int class_count() const;  // 0 where the file does not tell it
  // The names of the classes in the file; often empty.
  const std::map<int, std::string>& class_names() const;

 private:
  struct Impl;
  explicit Detector(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace oaslam
