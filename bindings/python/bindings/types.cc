#include "oaslam/types.h"

#include "bindings.h"
#include "oaslam/error.h"
#include "oaslam/ids.h"
#include "oaslam/slam.h"

namespace oaslam::python {
namespace {

template <typename Id>
void AddId(py::module_& m, const char* name, const char* text) {
  py::class_<Id>(m, name, text)
      .def(py::init<uint32_t>(), py::arg("value"), text)
      .def_property_readonly(
          "value", [](Id id) { return id.value; }, "The number, as in arrays and files.")
      .def("__int__", [](Id id) { return id.value; })
      .def("__index__", [](Id id) { return id.value; })
      .def("__hash__", [](Id id) { return std::hash<Id>()(id); })
      .def(
          "__eq__", [](Id a, Id b) { return a == b; }, py::is_operator())
      .def(
          "__lt__", [](Id a, Id b) { return a < b; }, py::is_operator())
      .def(py::pickle([](Id id) { return id.value; }, [](uint32_t value) { return Id(value); }))
      .def("__str__", [](Id id) { return ToString(id); })
      .def("__repr__", [name](Id id) { return std::string(name) + "(" + ToString(id) + ")"; });
}

}  // namespace

void AddErrors(py::module_& m) {
  static const py::handle input_error = [&m] {
    const py::exception<InputError> type(m, "InputError", PyExc_ValueError);
    type.doc() = doc::InputError;
    return py::object(type).release();
  }();
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      PyErr_SetObject(input_error.ptr(), FileTextOf(error.what()).ptr());
    }
  });
  py::register_exception<MappingError>(m, "MappingError", PyExc_RuntimeError).doc() =
      doc::MappingError;
  py::register_exception<ForkError>(m, "ForkError", PyExc_RuntimeError).doc() = doc::ForkError;
}

void AddTypes(py::module_& m) {
  AddId<KeyframeId>(m, "KeyframeId", "The id of a keyframe of a map.");
  AddId<LandmarkId>(m, "LandmarkId", "The id of a landmark of a map.");
  AddId<ObjectId>(m, "ObjectId", "The id of an object of a map.");
  AddId<WorldId>(m, "WorldId",
                 "The frame of reference and unit of coordinates: two worlds have nothing in "
                 "common.");
  auto state = py::enum_<TrackingState>(m, "TrackingState", doc::TrackingState)
                   .value("INITIALIZING", TrackingState::kInitializing)
                   .value("TRACKING", TrackingState::kTracking)
                   .value("RELOCALIZED", TrackingState::kRelocalized)
                   .value("OBJECTS", TrackingState::kObjects)
                   .value("LOST", TrackingState::kLost)
                   .value("ODOMETRY", TrackingState::kOdometry)
                   .value("PRELIMINARY", TrackingState::kPreliminary);
  SayAsToString(state);
  auto source = py::enum_<PoseSource>(m, "PoseSource", doc::PoseSource)
                    .value("NONE", PoseSource::kNone)
                    .value("MAP", PoseSource::kMap)
                    .value("MOTION", PoseSource::kMotion)
                    .value("OBJECTS", PoseSource::kObjects)
                    .value("REGISTRATION", PoseSource::kRegistration);
  SayAsToString(source);
  auto gyroscope = py::enum_<GyroscopeState>(m, "GyroscopeState", doc::GyroscopeState)
                       .value("UNKNOWN", GyroscopeState::kUnknown)
                       .value("CALIBRATED", GyroscopeState::kCalibrated)
                       .value("REFUSED", GyroscopeState::kRefused);
  SayAsWord(gyroscope);
  auto accelerometer =
      py::enum_<AccelerometerState>(m, "AccelerometerState", doc::AccelerometerState)
          .value("UNKNOWN", AccelerometerState::kUnknown)
          .value("CALIBRATED", AccelerometerState::kCalibrated)
          .value("REFUSED", AccelerometerState::kRefused);
  SayAsWord(accelerometer);
  auto evidence = py::enum_<PoseEvidence>(m, "PoseEvidence", doc::PoseEvidence)
                      .value("NONE", PoseEvidence::kNone)
                      .value("POINTS", PoseEvidence::kPoints)
                      .value("OBJECTS", PoseEvidence::kObjects)
                      .value("POINTS_AND_OBJECTS", PoseEvidence::kPointsAndObjects);
  SayAsToString(evidence);
  auto mode = py::enum_<RelocalizationMode>(m, "RelocalizationMode", doc::RelocalizationMode)
                  .value("POINTS", RelocalizationMode::kPoints)
                  .value("OBJECTS", RelocalizationMode::kObjects)
                  .value("POINTS_AND_OBJECTS", RelocalizationMode::kPointsAndObjects);
  SayAsToString(mode);
  m.def("relocalization_mode_of", &RelocalizationModeOf, py::arg("name"),
        doc::RelocalizationModeOf);

  Value<Box>(m, "Box", doc::Box)
      .def(py::init([](double x1, double y1, double x2, double y2) {
             return Box{x1, y1, x2, y2};
           }),
           py::arg("x1") = 0, py::arg("y1") = 0, py::arg("x2") = 0, py::arg("y2") = 0, doc::Box)
      .def_readwrite(OASLAM_FIELD(Box, x1))
      .def_readwrite(OASLAM_FIELD(Box, y1))
      .def_readwrite(OASLAM_FIELD(Box, x2))
      .def_readwrite(OASLAM_FIELD(Box, y2))
      .def("width", &Box::Width, doc::Box_Width)
      .def("height", &Box::Height, doc::Box_Height)
      .def("area", &Box::Area, doc::Box_Area)
      .def("__repr__", [](const Box& b) {
        return py::str("Box({}, {}, {}, {})").format(b.x1, b.y1, b.x2, b.y2);
      });
  Value<Label>(m, "Label", doc::Label)
      .def(py::init([](int category_id, double score) {
             return Label{category_id, score};
           }),
           py::arg("category_id"), py::arg("score"), doc::Label)
      .def_readwrite(OASLAM_FIELD(Label, category_id))
      .def_readwrite(OASLAM_FIELD(Label, score));
  Value<Detection>(m, "Detection", doc::Detection)
      .def(py::init([](int category_id, double score, const Box& box,
                       const std::optional<std::array<double, 5>>& ellipse,
                       const std::vector<Label>& other_labels) {
             return Detection{category_id, score, box, ellipse, other_labels};
           }),
           py::arg("category_id"), py::arg("score"), py::arg("box"),
           py::arg("ellipse") = std::nullopt, py::arg("other_labels") = py::tuple(), doc::Detection)
      .def_readwrite(OASLAM_FIELD(Detection, category_id))
      .def_readwrite(OASLAM_FIELD(Detection, score))
      .def_readwrite(OASLAM_FIELD(Detection, box))
      .def_readonly(OASLAM_FIELD(Detection, ellipse))
      .def_tuple(OASLAM_FIELD(Detection, other_labels))
      .def("__repr__", [](const Detection& d) {
        return py::str("Detection({}, {}, {!r})").format(d.category_id, d.score, d.box);
      });
  Value<Ellipsoid>(m, "Ellipsoid", doc::Ellipsoid)
      .def_readonly(OASLAM_FIELD(Ellipsoid, center))
      .def_readonly(OASLAM_FIELD(Ellipsoid, half_axes))
      .keep("rotation", &Ellipsoid::rotation)
      .def_property_readonly(
          "rotation", [](const Ellipsoid& e) { return ArrayOf(e.rotation.toRotationMatrix()); },
          doc::Ellipsoid_rotation);
}

}  // namespace oaslam::python
