#include "oaslam/map_snapshot.h"

#include <cstring>
#include <string>
#include <variant>

#include "bindings.h"
#include "rows.h"

namespace oaslam::python {
namespace {

void CopyPose(const Rigid3& pose, double (&matrix)[4][4]) {
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> to(&matrix[0][0]);
  to.setIdentity();
  to.topRows<3>() = pose.Matrix();
}

KeyframeRow RowOf(const MapSnapshot::Keyframe& k) {
  KeyframeRow row{k.id.value, k.frame.value_or(-1), k.timestamp, k.camera, {}};
  CopyPose(k.world_from_cam, row.world_from_cam);
  return row;
}

LandmarkRow RowOf(const MapSnapshot::Landmark& l) {
  return {l.id.value, {l.position.x(), l.position.y(), l.position.z()}, l.observations};
}

ObservationRow RowOf(const MapSnapshot::Observation& o) {
  return {o.keyframe.value, o.landmark.value, o.keypoint, {o.pixel.x(), o.pixel.y()}, o.sigma_px};
}

// All elements of a kind as an array of records. Releases Python's lock, since it takes a while for
// a large map.
template <typename Row, typename Element>
auto AsRows(MapSnapshot::Range<Element> (MapSnapshot::*range)() const) {
  return [range](const MapSnapshot& map) {
    std::vector<Row> rows;
    {
      const WithoutPythonsLock without_gil;
      const auto elements = (map.*range)();
      rows.reserve(elements.size());
      for (const Element& element : elements) rows.push_back(RowOf(element));
    }
    return ArrayOfRows(std::move(rows));
  };
}

SightingRow RowOf(const MapSnapshot::Sighting& s) {
  SightingRow row{s.keyframe ? int64_t{s.keyframe->value} : -1,
                  s.frame.value_or(-1),
                  {},
                  {s.box.x1, s.box.y1, s.box.x2, s.box.y2},
                  s.score};
  CopyPose(s.world_from_cam, row.world_from_cam);
  return row;
}

py::array Observations(const MapSnapshot& map,
                       const std::variant<KeyframeId, LandmarkId, ObjectId>& of) {
  return std::visit(
      [&](auto id) -> py::array {
        const auto seen = map.Observations(id);
        std::vector<decltype(RowOf(seen.front()))> rows;
        for (const auto& o : seen) rows.push_back(RowOf(o));
        return ArrayOfRows(std::move(rows));
      },
      of);
}

// The bytes of all descriptors of a keyframe, a row each.
py::array_t<uint8_t> Descriptors(const MapSnapshot& map, KeyframeId keyframe) {
  const auto descriptors = map.Descriptors(keyframe);
  constexpr size_t kBytes = sizeof(MapSnapshot::Descriptor);
  py::array_t<uint8_t> array(std::vector<size_t>{descriptors.size(), kBytes});
  if (!descriptors.empty())
    std::memcpy(array.mutable_data(), descriptors.data(), descriptors.size_bytes());
  return array;
}

void AddElements(py::handle snapshot) {
  using Keyframe = MapSnapshot::Keyframe;
  Value<Keyframe>(snapshot, "Keyframe", doc::MapSnapshot_Keyframe)
      .def_readonly(OASLAM_FIELD(Keyframe, id))
      .def_readonly(OASLAM_FIELD(Keyframe, frame))
      .def_readonly(OASLAM_FIELD(Keyframe, timestamp))
      .def_readonly(OASLAM_FIELD(Keyframe, camera))
      .def_readonly(OASLAM_FIELD(Keyframe, world_from_cam));
  using Landmark = MapSnapshot::Landmark;
  Value<Landmark>(snapshot, "Landmark", doc::MapSnapshot_Landmark)
      .def_readonly(OASLAM_FIELD(Landmark, id))
      .def_readonly(OASLAM_FIELD(Landmark, position))
      .def_readonly(OASLAM_FIELD(Landmark, observations));
  using Object = MapSnapshot::Object;
  Value<Object>(snapshot, "Object", doc::MapSnapshot_Object)
      .def_readonly(OASLAM_FIELD(Object, id))
      .def_readonly(OASLAM_FIELD(Object, category_id))
      .def_readonly(OASLAM_FIELD(Object, name))
      .def_readonly(OASLAM_FIELD(Object, ellipsoid))
      .def_array(OASLAM_FIELD(Object, covariance))
      .def_readonly(OASLAM_FIELD(Object, observations))
      .def_readonly(OASLAM_FIELD(Object, has_moved))
      .def("__repr__", [](const Object& o) {
        return "<Object " + ToString(o.id) + ": " + o.name + ", " + std::to_string(o.observations) +
               " observations>";
      });
}

}  // namespace

void AddMap(py::module_& m) {
  PYBIND11_NUMPY_DTYPE(KeyframeRow, id, frame, timestamp, camera, world_from_cam);
  PYBIND11_NUMPY_DTYPE(LandmarkRow, id, position, observations);
  PYBIND11_NUMPY_DTYPE(ObservationRow, keyframe, landmark, keypoint, pixel, sigma_px);
  PYBIND11_NUMPY_DTYPE(SightingRow, keyframe, frame, world_from_cam, box, score);
  Value<AnchorPose>(m, "AnchorPose", doc::AnchorPose)
      .def_readonly(OASLAM_FIELD(AnchorPose, name))
      .def_readonly(OASLAM_FIELD(AnchorPose, model))
      .def_readonly(OASLAM_FIELD(AnchorPose, size))
      .def_readonly(OASLAM_FIELD(AnchorPose, world_from_anchor))
      .def_readonly(OASLAM_FIELD(AnchorPose, object))
      .def_readonly(OASLAM_FIELD(AnchorPose, cam_from_anchor));
  py::enum_<HitKind>(m, "HitKind", doc::HitKind)
      .value("OBJECT", HitKind::kObject)
      .value("PLANE", HitKind::kPlane)
      .value("LANDMARK", HitKind::kLandmark);
  Value<RayHit>(m, "RayHit", doc::RayHit)
      .def_readonly(OASLAM_FIELD(RayHit, kind))
      .def_readonly(OASLAM_FIELD(RayHit, distance))
      .def_readonly(OASLAM_FIELD(RayHit, position))
      .def_readonly(OASLAM_FIELD(RayHit, normal))
      .def_readonly(OASLAM_FIELD(RayHit, object))
      .def_readonly(OASLAM_FIELD(RayHit, landmark));
  Value<AnchorReport>(m, "AnchorReport", doc::AnchorReport)
      .def_readonly(OASLAM_FIELD(AnchorReport, name))
      .def_readonly(OASLAM_FIELD(AnchorReport, why_not))
      .def("is_done", &AnchorReport::IsDone, doc::AnchorReport_IsDone)
      .def("__bool__", &AnchorReport::IsDone);
  Value<ScaleEstimate>(m, "ScaleEstimate", doc::ScaleEstimate)
      .def_readonly(OASLAM_FIELD(ScaleEstimate, success))
      .def_readonly(OASLAM_FIELD(ScaleEstimate, why_not))
      .def_readonly(OASLAM_FIELD(ScaleEstimate, metres_per_unit))
      .def_readonly(OASLAM_FIELD(ScaleEstimate, relative_sigma))
      .def_readonly(OASLAM_FIELD(ScaleEstimate, objects))
      .def_readonly(OASLAM_FIELD(ScaleEstimate, classes));
  py::class_<MapSnapshot> snapshot(m, "MapSnapshot", doc::MapSnapshot);
  AddElements(snapshot);
  snapshot.def(py::init(), doc::MapSnapshot_MapSnapshot)
      .def_static(
          "load",
          [](const PathText& path, int submap) {
            const WithoutPythonsLock without_gil;
            return MapSnapshot::Load(path, submap);
          },
          py::arg("path"), py::arg("submap") = 0, doc::MapSnapshot_Load)
      .def(
          "save", [](const MapSnapshot& map, const PathText& path) { map.Save(path); },
          py::arg("path"), WithoutGil(), doc::MapSnapshot_Save)
      .def_static(
          "from_bytes",
          [](const py::bytes& bytes, int submap) {
            const auto content = static_cast<std::string>(bytes);
            const WithoutPythonsLock without_gil;
            return MapSnapshot::FromBytes(content, submap);
          },
          py::arg("bytes"), py::arg("submap") = 0, doc::MapSnapshot_FromBytes)
      .def(
          "to_bytes",
          [](const MapSnapshot& map) {
            std::string content;
            {
              const WithoutPythonsLock without_gil;
              content = map.ToBytes();
            }
            return py::bytes(content);
          },
          "The same as bytes, to be sent or kept elsewhere: what save writes.")
      .def_property_readonly(
          "keyframe_count", [](const MapSnapshot& map) { return map.Keyframes().size(); },
          "The number of keyframes.")
      .def_property_readonly(
          "landmark_count", [](const MapSnapshot& map) { return map.Landmarks().size(); },
          "The number of landmarks.")
      .def("keyframes", AsRows<KeyframeRow>(&MapSnapshot::Keyframes),
           (std::string(doc::MapSnapshot_Keyframes) +
            " Columns: id, frame (-1: of a file), timestamp, camera, world_from_cam.")
               .c_str())
      .def("landmarks", AsRows<LandmarkRow>(&MapSnapshot::Landmarks),
           (std::string(doc::MapSnapshot_Landmarks) + " Columns: id, position, observations.")
               .c_str())
      .def(
          "objects", [](const MapSnapshot& map) { return map.Objects().ToVector(); }, WithoutGil(),
          doc::MapSnapshot_Objects)
      .def(
          "find_keyframe", [](const MapSnapshot& map, KeyframeId id) { return map.Find(id); },
          py::arg("id"), doc::MapSnapshot_Find)
      .def(
          "find_landmark", [](const MapSnapshot& map, LandmarkId id) { return map.Find(id); },
          py::arg("id"), doc::MapSnapshot_Find)
      .def(
          "find_object", [](const MapSnapshot& map, ObjectId id) { return map.Find(id); },
          py::arg("id"), doc::MapSnapshot_Find)
      .def(
          "observations", &Observations, py::arg("of"),
          "The landmarks that a keyframe sees, or the keyframes that see a landmark: keyframe, "
          "landmark, keypoint, pixel, sigma_px. Of an object the boxes from which its ellipsoid is "
          "estimated, of many images at most 60 that tell most: keyframe (-1: another image), "
          "frame "
          "(-1: of a file), world_from_cam, box (x1, y1, x2, y2 in the image without distortion), "
          "score.")
      .def("descriptors", &Descriptors, py::arg("keyframe"),
           "ORB's descriptors of all key points of a keyframe, 32 bytes in a row.")
      .def("trajectory", &MapSnapshot::Trajectory, WithoutGil(), doc::MapSnapshot_Trajectory)
      .def("category_names", &MapSnapshot::CategoryNames, doc::MapSnapshot_CategoryNames)
      .def("anchors", &MapSnapshot::Anchors, doc::MapSnapshot_Anchors)
      .def("cast", &MapSnapshot::Cast, py::arg("origin"), py::arg("direction"), WithoutGil(),
           doc::MapSnapshot_Cast)
      .def("cameras", &MapSnapshot::Cameras, doc::MapSnapshot_Cameras)
      .def_property_readonly("submaps", &MapSnapshot::submaps, doc::MapSnapshot_submaps)
      .def_property_readonly("world", &MapSnapshot::world, doc::MapSnapshot_world)
      .def_property_readonly("up", &MapSnapshot::up, doc::MapSnapshot_up)
      .def_property_readonly("is_up_measured", &MapSnapshot::is_up_measured,
                             doc::MapSnapshot_is_up_measured)
      .def_property_readonly("is_metric", &MapSnapshot::is_metric, doc::MapSnapshot_is_metric)
      .def_property_readonly("unit_sigma", &MapSnapshot::unit_sigma, doc::MapSnapshot_unit_sigma)
      .def("estimate_scale", &MapSnapshot::EstimateScale, WithoutGil(),
           doc::MapSnapshot_EstimateScale)
      .def_property_readonly("version", &MapSnapshot::version, doc::MapSnapshot_version);
}

}  // namespace oaslam::python
