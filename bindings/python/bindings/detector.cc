#include "oaslam/detector.h"

#include "bindings.h"
#include "exclusive.h"
#include "oaslam/background_detector.h"

namespace oaslam::python {
namespace {

using SharedDetector = std::unique_ptr<Detector>;
using ExclusiveDetector = Exclusive<SharedDetector>;

std::shared_ptr<ExclusiveDetector> LoadDetector(const PathText& model, double min_score,
                                                double max_iou,
                                                const std::pair<int, int>& input_size,
                                                DetectorLayout layout, NetworkBackend backend) {
  const DetectorOptions options{
      min_score, max_iou, {input_size.first, input_size.second}, layout, backend};
  SharedDetector detector;
  {
    const WithoutPythonsLock without_gil;
    detector = Detector::Load(model, options);
  }
  return MakeWithoutGil<ExclusiveDetector>(std::move(detector));
}

// Its thread calls a Python function, which may return None by mistake.
std::shared_ptr<BackgroundDetector> MakeBackgroundDetector(BackgroundDetector::Detect detect) {
  if (!detect) return MakeWithoutGil<BackgroundDetector>(nullptr);  // throws
  return MakeWithoutGil<BackgroundDetector>([kept = KeptFromPython(std::move(detect))](
                                                const cv::Mat& image) {
    std::vector<Detection> found;
    try {
      CallPython([&] { found = (*kept)(image); });
    } catch (const py::cast_error&) {
      throw py::type_error("the function of a BackgroundDetector returns a sequence of Detection");
    }
    return found;
  });
}

void AddDetector(py::module_& m) {
  const DetectorOptions options;
  py::class_<ExclusiveDetector, std::shared_ptr<ExclusiveDetector>>(m, "Detector", doc::Detector)
      .def_static("load", &LoadDetector, py::arg("model") = "default", py::kw_only(),
                  py::arg("min_score") = options.min_score, py::arg("max_iou") = options.max_iou,
                  py::arg("input_size") = std::pair(0, 0), py::arg("layout") = options.layout,
                  py::arg("backend") = options.backend, doc::Detector_Load)
      .def(
          "detect",
          [](ExclusiveDetector& detector, const cv::Mat& image) {
            return detector.Use([&](SharedDetector& d) { return d->Detect(image); });
          },
          py::arg("image"), doc::Detector_Detect)
      .def_property_readonly(
          "layout",
          [](ExclusiveDetector& detector) {
            return detector.Use([](SharedDetector& d) { return d->layout(); });
          },
          doc::Detector_layout)
      .def_property_readonly(
          "input_size",
          [](ExclusiveDetector& detector) {
            const cv::Size size = detector.Use([](SharedDetector& d) { return d->input_size(); });
            return std::pair(size.width, size.height);
          },
          doc::Detector_input_size)
      .def_property_readonly(
          "class_count",
          [](ExclusiveDetector& detector) {
            return detector.Use([](SharedDetector& d) { return d->class_count(); });
          },
          doc::Detector_class_count)
      .def_property_readonly(
          "class_names",
          [](ExclusiveDetector& detector) {
            return detector.Use([](SharedDetector& d) { return std::map(d->class_names()); });
          },
          doc::Detector_class_names);
}

void AddBackgroundDetector(py::module_& m) {
  using Result = BackgroundDetector::Result;
  py::class_<BackgroundDetector, std::shared_ptr<BackgroundDetector>> background(
      m, "BackgroundDetector", doc::BackgroundDetector);
  Value<Result>(background, "Result", doc::BackgroundDetector_Result)
      .def_readonly(OASLAM_FIELD(Result, frame))
      .def_tuple(OASLAM_FIELD(Result, detections));
  background
      .def(py::init(&MakeBackgroundDetector), py::arg("detect"),
           doc::BackgroundDetector_BackgroundDetector)
      .def("offer", &BackgroundDetector::Offer, py::arg("frame"), py::arg("image"), WithoutGil(),
           doc::BackgroundDetector_Offer)
      .def("take", &BackgroundDetector::Take, WithoutGil(), doc::BackgroundDetector_Take)
      .def("wait", &BackgroundDetector::Wait, WithoutGil(), doc::BackgroundDetector_Wait)
      .def("clear", &BackgroundDetector::Clear, WithoutGil(), doc::BackgroundDetector_Clear)
      .def_property_readonly("images", &BackgroundDetector::images, doc::BackgroundDetector_images)
      .def_property_readonly("busy_ms", &BackgroundDetector::busy_ms,
                             doc::BackgroundDetector_busy_ms);
}

}  // namespace

void AddDetectors(py::module_& m) {
  auto layout = py::enum_<DetectorLayout>(m, "DetectorLayout", doc::DetectorLayout)
                    .value("AUTO", DetectorLayout::kAuto)
                    .value("YOLOX", DetectorLayout::kYolox, doc::DetectorLayout_kYolox)
                    .value("YOLOV5", DetectorLayout::kYolov5, doc::DetectorLayout_kYolov5)
                    .value("YOLOV8", DetectorLayout::kYolov8, doc::DetectorLayout_kYolov8)
                    .value("END_TO_END", DetectorLayout::kEndToEnd, doc::DetectorLayout_kEndToEnd)
                    .value("RT_DETR", DetectorLayout::kRtDetr, doc::DetectorLayout_kRtDetr);
  SayAsToString(layout);
  auto backend = py::enum_<NetworkBackend>(m, "NetworkBackend", doc::NetworkBackend)
                     .value("AUTO", NetworkBackend::kAuto)
                     .value("ONNX_RUNTIME", NetworkBackend::kOnnxRuntime)
                     .value("OPEN_CV", NetworkBackend::kOpenCv);
  SayAsToString(backend);
  m.def("detector_layout_from_string", &DetectorLayoutFromString, py::arg("name"),
        doc::DetectorLayoutFromString);
  m.def("network_backend_from_string", &NetworkBackendFromString, py::arg("name"),
        doc::NetworkBackendFromString);
  m.def(
      "find_detector_model", [](const PathText& model) { return FindDetectorModel(model); },
      py::arg("model") = "default", doc::FindDetectorModel);
  AddDetector(m);
  AddBackgroundDetector(m);
}

}  // namespace oaslam::python
