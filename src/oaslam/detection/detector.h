#pragma once

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "oaslam/detection/yolo_output.h"
#include "oaslam/types.h"

namespace oaslam {

struct DetectorOptions {
  double min_score = 0.2;  // detections at or below are not given out
  double max_iou = 0.45;   // of two boxes of a class that overlap more, the weaker one goes
  cv::Size input_size{};   // of the network; {0, 0}: what the file says, 640x640 where it leaves
                           // that open
  DetectorLayout layout = DetectorLayout::kAuto;  // told apart by shape and metadata; see
                                                  // docs/formats.md for what is ambiguous
};

// An object detector of the YOLO family in an ONNX file, run on the CPU by OpenCV. One image at a
// time: not thread-safe.
class Detector {
 public:
  // Throws InputError: no such file, no ONNX, a network that is no detector or not of the layout
  // asked for.
  static std::unique_ptr<Detector> Load(const std::string& path,
                                        const DetectorOptions& options = {});
  ~Detector();

  // Of an 8-bit image (BGR or grey); boxes in its pixels, clipped to it, best first.
  std::vector<Detection> Detect(const cv::Mat& image);

  DetectorLayout layout() const;
  cv::Size input_size() const;
  int class_count() const;  // 0 where the file does not say
  // As the file itself names its classes; often empty.
  const std::map<int, std::string>& class_names() const;

 private:
  struct Impl;
  explicit Detector(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace oaslam
