#include "detector_options.h"

namespace oaslam::apps {

CLI::Option* AddDetectorOptions(CLI::App& app, DetectorSettings& settings) {
  app.add_option("--detector-layout", settings.layout,
                 "Layout of the network's output, if it is not recognised correctly")
      ->check(CLI::IsMember({"auto", "yolox", "yolov5", "yolov8", "end2end"}))
      ->capture_default_str();
  app.add_option("--detector-size", settings.size,
                 "Side of the network's square input in pixels, where the file leaves it open")
      ->check(CLI::Range(32, 4096));
  app.add_option("--detector-min-score", settings.min_score,
                 "Detections at or below this score are dropped")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  return app
      .add_option("--detector", settings.model, "Object detector: an ONNX file of the YOLO family")
      ->type_name("ONNX");
}

std::unique_ptr<Detector> LoadDetector(const DetectorSettings& settings) {
  if (settings.model.empty()) return nullptr;
  DetectorOptions options;
  options.layout = DetectorLayoutFromString(settings.layout).value_or(DetectorLayout::kAuto);
  options.input_size = {settings.size, settings.size};
  options.min_score = settings.min_score;
  return Detector::Load(settings.model, options);
}

Classes ClassesFor(const CommonOptions& common, const Detector* detector) {
  if (common.classes.empty() && detector != nullptr && !detector->class_names().empty())
    return {detector->class_names(), {}};
  return LoadClasses(common);
}

}  // namespace oaslam::apps
