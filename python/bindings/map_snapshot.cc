#include "oaslam/map_snapshot.h"

#include "bindings.h"
#include "rows.h"

namespace oaslam::python {
namespace {

template <typename Row, typename Values, typename Function>
py::array_t<Row> Rows(const Values& values, Function&& row_of) {
  std::vector<Row> rows;
  rows.reserve(values.size());
  for (const auto& value : values) rows.push_back(row_of(value));
  return ArrayOfRows(std::move(rows));
}

KeyframeRow RowOf(const MapSnapshot::Keyframe& k) {
  KeyframeRow row{k.id, k.frame.value_or(-1), k.timestamp, k.camera, {}};
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> pose(&row.world_from_cam[0][0]);
  pose.setIdentity();
  pose.topRows<3>() = k.world_from_cam.Matrix();
  return row;
}

LandmarkRow RowOf(const MapSnapshot::Landmark& l) {
  return {l.id, {l.position.x(), l.position.y(), l.position.z()}, l.observations};
}

ObservationRow RowOf(const MapSnapshot::Observation& o) {
  return {o.keyframe, o.landmark, {o.pixel.x(), o.pixel.y()}, o.sigma_px};
}

// The result of a function of a snapshot as an array of records. Releases Python's lock, since it
// takes a while for a large map.
template <typename Row, typename Value, typename... Args>
auto AsRows(std::vector<Value> (MapSnapshot::*function)(Args...) const) {
  return [function](const MapSnapshot& map, Args... args) {
    std::vector<Value> values;
    {
      const WithoutPythonsLock without_gil;
      values = (map.*function)(args...);
    }
    return Rows<Row>(values, [](const Value& value) { return RowOf(value); });
  };
}

void AddObject(py::handle snapshot) {
  using Object = MapSnapshot::Object;
  py::class_<Object>(snapshot, "Object", doc::MapSnapshot_Object)
      .def_readonly(OASLAM_FIELD(Object, id))
      .def_readonly(OASLAM_FIELD(Object, category_id))
      .def_readonly(OASLAM_FIELD(Object, name))
      .def_readonly(OASLAM_FIELD(Object, ellipsoid))
      .def_property_readonly(
          "covariance", [](const Object& o) { return ArrayOf(o.covariance); },
          doc::Object_covariance)
      .def_readonly(OASLAM_FIELD(Object, observations))
      .def_readonly(OASLAM_FIELD(Object, has_moved));
}

}  // namespace

void AddMap(py::module_& m) {
  PYBIND11_NUMPY_DTYPE(KeyframeRow, id, frame, timestamp, camera, world_from_cam);
  PYBIND11_NUMPY_DTYPE(LandmarkRow, id, position, observations);
  PYBIND11_NUMPY_DTYPE(ObservationRow, keyframe, landmark, pixel, sigma_px);
  py::class_<AnchorPose>(m, "AnchorPose", doc::AnchorPose)
      .def_readonly(OASLAM_FIELD(AnchorPose, name))
      .def_readonly(OASLAM_FIELD(AnchorPose, model))
      .def_readonly(OASLAM_FIELD(AnchorPose, size))
      .def_readonly(OASLAM_FIELD(AnchorPose, world_from_anchor))
      .def_readonly(OASLAM_FIELD(AnchorPose, object));
  py::class_<AnchorReport>(m, "AnchorReport", doc::AnchorReport)
      .def_readonly(OASLAM_FIELD(AnchorReport, name))
      .def_readonly(OASLAM_FIELD(AnchorReport, why_not));
  py::class_<MapSnapshot> snapshot(m, "MapSnapshot", doc::MapSnapshot);
  AddObject(snapshot);
  snapshot.def(py::init(), doc::MapSnapshot_MapSnapshot)
      .def_property_readonly("keyframe_count", &MapSnapshot::keyframe_count,
                             doc::MapSnapshot_keyframe_count)
      .def_property_readonly("landmark_count", &MapSnapshot::landmark_count,
                             doc::MapSnapshot_landmark_count)
      .def("keyframes", AsRows<KeyframeRow>(&MapSnapshot::Keyframes), doc::MapSnapshot_Keyframes)
      .def("landmarks", AsRows<LandmarkRow>(&MapSnapshot::Landmarks), doc::MapSnapshot_Landmarks)
      .def("objects", &MapSnapshot::Objects, WithoutGil(), doc::MapSnapshot_Objects)
      .def("observations_in_keyframe", AsRows<ObservationRow>(&MapSnapshot::ObservationsInKeyframe),
           py::arg("keyframe"), doc::MapSnapshot_ObservationsInKeyframe)
      .def("observations_of_landmark", AsRows<ObservationRow>(&MapSnapshot::ObservationsOfLandmark),
           py::arg("landmark"), doc::MapSnapshot_ObservationsOfLandmark)
      .def("anchors", &MapSnapshot::Anchors, doc::MapSnapshot_Anchors)
      .def("cameras", &MapSnapshot::Cameras, doc::MapSnapshot_Cameras)
      .def_property_readonly("up", &MapSnapshot::up, doc::MapSnapshot_up)
      .def_property_readonly("is_metric", &MapSnapshot::is_metric, doc::MapSnapshot_is_metric)
      .def_property_readonly("version", &MapSnapshot::version, doc::MapSnapshot_version);
}

}  // namespace oaslam::python
