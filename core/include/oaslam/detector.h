#pragma once

#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/types.h"

namespace oaslam {

// The layout of a detector's output, for N candidates and C classes. It also tells how the family
// expects its input.
enum class DetectorLayout {
  kAuto,
  // N x (5 + C): offsets in grid cells and log sizes (strides 8, 16, 32), objectness. Input: BGR
  // 0..255, padded at the right and the bottom.
  kYolox,
  // N x (5 + C): cx cy w h in network pixels, objectness (v5, v6, v7). Input: RGB 0..1, padded on
  // both sides.
  kYolov5,
  // (4 + C) x N, or N x (4 + C): cx cy w h in network pixels, no objectness (v8, v9, v11, v12).
  // Input: as kYolov5.
  kYolov8,
  // N x 6: x1 y1 x2 y2 score class, already suppressed (v10, exports with NMS). Input: as kYolov5.
  kEndToEnd,
  // N x (4 + C), or N x 6 with score and class: cx cy w h as shares of the image (RT-DETR). Input:
  // RGB 0..1, stretched to the input's size.
  kRtDetr,
};

// "auto", "yolox", "yolov5", "yolov8", "end2end", "rtdetr".
OASLAM_API const char* ToString(DetectorLayout layout);
// Nothing for any other word.
OASLAM_API std::optional<DetectorLayout> DetectorLayoutFromString(const std::string& name);

// The libraries that run networks. kAuto: ONNX Runtime where it is built in, else OpenCV.
enum class NetworkBackend { kAuto, kOnnxRuntime, kOpenCv };

// "auto", "onnxruntime", "opencv".
OASLAM_API const char* ToString(NetworkBackend backend);
// Nothing for any other word.
OASLAM_API std::optional<NetworkBackend> NetworkBackendFromString(const std::string& name);

// How a network is run, and which of its boxes are kept.
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
// thread-safe:
//
//   const std::unique_ptr<Detector> detector = Detector::Load("yolox_nano");
//   slam.Process({image, timestamp, detector->Detect(image)});
class OASLAM_API Detector {
 public:
  // `model`: the path of an ONNX file, or the name of a detector (FindDetectorModel).
  // Of a network for keypoints or oriented boxes, the boxes alone are used: of an oriented one, the
  // upright box around it; a message says so. Throws InputError where the file is missing, is no
  // ONNX file, or its network is no detector, does not have the requested layout, or cannot be run
  // by the requested library.
  static std::unique_ptr<Detector> Load(const std::string& model,
                                        const DetectorOptions& options = {});
  ~Detector();

  // Detects objects in an 8-bit image (grey, BGR or BGRA; else InputError). Boxes are in its
  // pixels, clipped to it, best first. It takes tenths of a second, on the caller's thread. Throws
  // InputError where scores outside 0 to 1, or in the first images most boxes outside the image,
  // show that the output has another layout.
  std::vector<Detection> Detect(const cv::Mat& image);

  // The layout that was requested or recognised; never kAuto.
  DetectorLayout layout() const;
  // The size of the network's input, pixels.
  cv::Size input_size() const;
  int class_count() const;  // 0 where the file does not tell it
  // The names of the classes in the file; often empty.
  const std::map<int, std::string>& class_names() const;

 private:
  struct Impl;
  explicit Detector(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

// The ONNX file of a detector. `model` is the path of a file, which is returned as it is, or a
// name, such as "yolox_nano". "default" stands for "yolox_nano" (YOLOX-nano, the 80 classes of
// COCO). No detector comes with OA-SLAM: `oaslam models get NAME` fetches one (docs/models.md).
// NAME.onnx is looked for in the folders that the environment names in OASLAM_MODELS (separated by
// colons), in the user's folder ($XDG_DATA_HOME/oaslam/models, by default
// ~/.local/share/oaslam/models), in PREFIX/share/oaslam/models where OA-SLAM is installed, and in
// /usr/share/oaslam/models. Throws InputError, which names the folders, where no folder has the
// file.
OASLAM_API std::string FindDetectorModel(const std::string& model = "default");

}  // namespace oaslam
