#include "oaslam/slam.h"

#include <type_traits>
#include <variant>

#include "bindings.h"
#include "exclusive.h"
#include "oaslam/map_localizer.h"
#include "rows.h"

namespace oaslam::python {
namespace {

using ExclusiveSlam = Exclusive<Slam>;
using OptionalPose = std::optional<Rigid3>;
using OptionalVector = std::optional<Eigen::Vector3d>;
using OptionalCamera = std::optional<Camera>;
using Detections = std::vector<Detection>;

// The members of an ImageInput as arguments.
std::string WithImageDocs(const char* text, bool in_sequence) {
  const auto line = [](const char* name, const char* comment) {
    return std::string("\n") + name + ": " + comment;
  };
  return std::string(text) + "\n" + line("image", doc::ImageInput_image) +
         line("timestamp", doc::ImageInput_timestamp) +
         line("detections", doc::ImageInput_detections) +
         (in_sequence ? line("detections_follow", doc::ImageInput_detections_follow) : "") +
         line("gravity_in_cam", doc::ImageInput_gravity_in_cam) +
         (in_sequence ? line("angular_velocity", doc::ImageInput_angular_velocity) +
                            line("imu", (std::string(doc::ImageInput_imu) +
                                         "\nRows of timestamp, wx, wy, wz, ax, ay, az.")
                                            .c_str())
                      : "") +
         line("depth", doc::ImageInput_depth) + line("depth_unit", doc::DepthImage_unit) +
         line("depth_camera", doc::DepthImage_camera) +
         line("cam_from_depth", doc::DepthImage_cam_from_depth);
}

// A view of an array of two dimensions; throws TypeError.
cv::Mat DepthView(const py::array& depth) {
  const bool is_counts = py::isinstance<py::array_t<uint16_t>>(depth);
  if ((!is_counts && !py::isinstance<py::array_t<float>>(depth)) || depth.ndim() != 2 ||
      depth.strides(1) != depth.itemsize() || depth.strides(0) < depth.shape(1) * depth.itemsize())
    throw py::type_error("depth: expected rows of uint16 or float32, contiguous");
  return {static_cast<int>(depth.shape(0)), static_cast<int>(depth.shape(1)),
          is_counts ? CV_16UC1 : CV_32FC1, const_cast<void*>(depth.data()),
          static_cast<size_t>(depth.strides(0))};
}

std::optional<DepthImage> DepthOf(const std::optional<py::array>& depth, double unit,
                                  const OptionalCamera& camera,
                                  const OptionalPose& cam_from_depth) {
  if (!depth) return std::nullopt;
  return DepthImage{DepthView(*depth), unit, camera, cam_from_depth.value_or(Rigid3()), {}};
}

TrackingResult Process(ExclusiveSlam& slam, const cv::Mat& image, double timestamp,
                       const Detections& detections, bool detections_follow,
                       const OptionalVector& gravity_in_cam,
                       const std::vector<std::array<double, 4>>& angular_velocity,
                       const std::vector<std::array<double, 7>>& imu,
                       const std::optional<py::array>& depth, double depth_unit,
                       const OptionalCamera& depth_camera, const OptionalPose& cam_from_depth) {
  ImageInput input{image, timestamp, detections, detections_follow, gravity_in_cam, {}};
  for (const auto& [time, x, y, z] : angular_velocity)
    input.angular_velocity.push_back({time, {x, y, z}});
  for (const auto& [time, wx, wy, wz, ax, ay, az] : imu)
    input.imu.push_back({time, {wx, wy, wz}, {ax, ay, az}});
  input.depth = DepthOf(depth, depth_unit, depth_camera, cam_from_depth);
  return slam.Use([&](Slam& s) { return s.Process(input); });
}

// The arguments of relocalize: those of an image, as process has them, then the options.
std::string WithOptionsDocs(const char* text) {
  const auto line = [](const char* name, const char* comment) {
    return std::string("\n") + name + ": " + comment;
  };
  return WithImageDocs(text, false) + line("camera", doc::RelocalizeOptions_camera) +
         line("prior", doc::RelocalizeOptions_prior) +
         line("unknown_camera", doc::RelocalizeOptions_unknown_camera) +
         line("follow", doc::RelocalizeOptions_follow);
}

template <typename Self>
RelocalizationResult Relocalize(Self& self, const std::optional<cv::Mat>& image, double timestamp,
                                const Detections& detections, const OptionalVector& gravity_in_cam,
                                RelocalizationMode mode, const OptionalPose& prior,
                                const OptionalCamera& camera, bool unknown_camera, bool follow,
                                const std::optional<py::array>& depth, double depth_unit,
                                const OptionalCamera& depth_camera,
                                const OptionalPose& cam_from_depth) {
  ImageInput input{image.value_or(cv::Mat()), timestamp, detections, false, gravity_in_cam, {}};
  input.depth = DepthOf(depth, depth_unit, depth_camera, cam_from_depth);
  const auto find = [&](auto& map) {
    return map.Relocalize(input, {mode, prior, camera, unknown_camera, follow});
  };
  if constexpr (std::is_same_v<Self, ExclusiveSlam>) {
    return self.Use(find);
  } else {
    const WithoutPythonsLock without_gil;
    return find(self);
  }
}

template <typename Self, typename Class>
void AddRelocalize(Class& type, const char* text) {
  type.def("relocalize", &Relocalize<Self>, py::arg("image") = std::nullopt,
           py::arg("timestamp") = 0, py::arg("detections") = py::tuple(), py::kw_only(),
           py::arg("gravity_in_cam") = std::nullopt,
           py::arg("mode") = RelocalizationMode::kPointsAndObjects, py::arg("prior") = std::nullopt,
           py::arg("camera") = std::nullopt, py::arg("unknown_camera") = false,
           py::arg("follow") = false, py::arg("depth") = std::nullopt,
           py::arg("depth_unit") = 0.001, py::arg("depth_camera") = std::nullopt,
           py::arg("cam_from_depth") = std::nullopt, WithOptionsDocs(text).c_str());
}

py::array_t<TrackedPointRow> TrackedPoints(ExclusiveSlam& slam) {
  std::vector<TrackedPointRow> rows;
  for (const TrackedPoint& p : slam.Use([](Slam& s) { return s.TrackedPoints(); }))
    rows.push_back({{p.pixel.x(), p.pixel.y()},
                    p.sigma_px,
                    p.landmark ? int64_t{p.landmark->value} : -1,
                    {p.position.x(), p.position.y(), p.position.z()}});
  return ArrayOfRows(std::move(rows));
}

AnchorReport PlaceAnchor(ExclusiveSlam& slam, const std::string& name, const std::string& model,
                         const std::optional<std::pair<double, double>>& pixel,
                         const OptionalVector& origin, const OptionalVector& direction,
                         std::optional<ObjectId> object, double size, const OptionalPose& pose) {
  AnchorRequest request{.name = name, .model = model, .object = object, .size = size, .pose = pose};
  if (pixel) request.pixel.emplace(pixel->first, pixel->second);
  if (origin) request.origin = *origin;
  if (direction) request.direction = *direction;
  return slam.Use([&](Slam& s) { return s.PlaceAnchor(request); });
}

AnchorReport EditAnchor(ExclusiveSlam& slam, const std::string& anchor,
                        const std::optional<std::string>& name,
                        const std::optional<std::string>& model, std::optional<double> size,
                        double turn_rad, const OptionalPose& pose) {
  return slam.Use([&](Slam& s) {
    return s.EditAnchor(anchor, {name, model, size, turn_rad, pose});
  });
}

using SlamClass = py::class_<ExclusiveSlam, std::shared_ptr<ExclusiveSlam>>;

void AddTracking(SlamClass& slam) {
  slam.def(py::init([](const SlamConfig& config, const Camera& camera) {
             return MakeWithoutGil<ExclusiveSlam>(config, camera);
           }),
           py::arg("config"), py::arg("camera"), doc::Slam)
      .def("process", &Process, py::arg("image"), py::arg("timestamp"),
           py::arg("detections") = py::tuple(), py::kw_only(), py::arg("detections_follow") = false,
           py::arg("gravity_in_cam") = std::nullopt, py::arg("angular_velocity") = py::tuple(),
           py::arg("imu") = py::tuple(), py::arg("depth") = std::nullopt,
           py::arg("depth_unit") = 0.001, py::arg("depth_camera") = std::nullopt,
           py::arg("cam_from_depth") = std::nullopt, WithImageDocs(doc::Slam_Process, true).c_str())
      .def("add_detections", Method(&Slam::AddDetections), py::arg("frame"), py::arg("detections"),
           doc::Slam_AddDetections)
      .def("set_relocalization_mode", Method(&Slam::SetRelocalizationMode), py::arg("mode"),
           doc::Slam_SetRelocalizationMode)
      .def("force_relocalization", Method(&Slam::ForceRelocalization),
           py::arg("near") = std::nullopt, doc::Slam_ForceRelocalization)
      .def("tracked_points", &TrackedPoints, doc::Slam_TrackedPoints)
      .def("states", Method(&Slam::States), doc::Slam_States);
}

void AddMapping(SlamClass& slam) {
  slam.def("set_mapping", Method(&Slam::SetMapping), py::arg("enabled"), doc::Slam_SetMapping)
      .def("set_class_names", Method(&Slam::SetClassNames), py::arg("names"),
           doc::Slam_SetClassNames)
      .def("set_class_relations", Method(&Slam::SetClassRelations), py::arg("relations"),
           doc::Slam_SetClassRelations)
      .def("name_recording", Method(&Slam::NameRecording), py::arg("name"), py::arg("images"),
           doc::Slam_NameRecording)
      .def("set_mask", Method(&Slam::SetMask), py::arg("mask"), doc::Slam_SetMask)
      .def("presence", Method(&Slam::Presence), doc::Slam_Presence)
      .def("former_worlds", Method(&Slam::FormerWorlds), doc::Slam_FormerWorlds)
      .def(
          "set_metres_per_unit",
          [](ExclusiveSlam& self, const std::variant<double, ScaleEstimate>& metres) {
            self.Use([&](Slam& s) {
              std::visit([&](const auto& m) { s.SetMetresPerUnit(m); }, metres);
            });
          },
          py::arg("metres"),
          (std::string(doc::Slam_SetMetresPerUnit) +
           "\n\nOr by an estimate of success (MapSnapshot.estimate_scale): the map keeps how sure "
           "its "
           "unit is.")
              .c_str())
      .def("anchors", Method(&Slam::Anchors), doc::Slam_Anchors)
      .def(
          "cast",
          [](ExclusiveSlam& self, const std::pair<double, double>& pixel) {
            return self.Use([&](Slam& s) { return s.Cast({pixel.first, pixel.second}); });
          },
          py::arg("pixel"), doc::Slam_Cast)
      .def("place_anchor", &PlaceAnchor, py::kw_only(), py::arg("name") = "", py::arg("model") = "",
           py::arg("pixel") = std::nullopt, py::arg("origin") = std::nullopt,
           py::arg("direction") = std::nullopt, py::arg("object") = std::nullopt,
           py::arg("size") = 0, py::arg("pose") = std::nullopt,
           (std::string(doc::Slam_PlaceAnchor) + "\n\n" + doc::AnchorRequest).c_str())
      .def("edit_anchor", &EditAnchor, py::arg("anchor"), py::kw_only(),
           py::arg("name") = std::nullopt, py::arg("model") = std::nullopt,
           py::arg("size") = std::nullopt, py::arg("turn_rad") = 0, py::arg("pose") = std::nullopt,
           doc::Slam_EditAnchor)
      .def("remove_anchor", Method(&Slam::RemoveAnchor), py::arg("name"), doc::Slam_RemoveAnchor)
      .def(
          "edit_object",
          [](ExclusiveSlam& self, ObjectId object, const std::optional<std::string>& name,
             std::optional<ObjectId> same_as, bool remove) {
            self.Use([&](Slam& s) { s.EditObject(object, {name, same_as, remove}); });
          },
          py::arg("object"), py::kw_only(), py::arg("name") = std::nullopt,
          py::arg("same_as") = std::nullopt, py::arg("remove") = false,
          ObjectEditDocs(doc::Slam_EditObject).c_str())
      .def("snapshot", Method(&Slam::Snapshot), doc::Slam_Snapshot)
      .def("trajectory", Method(&Slam::Trajectory), doc::Slam_Trajectory)
      .def("finish", Method(&Slam::Finish), doc::Slam_Finish)
      .def("whole_map", Method(&Slam::WholeMap), doc::Slam_WholeMap)
      .def("set_imu", Method(&Slam::SetImu), py::arg("cam_from_imu"), doc::Slam_SetImu)
      .def("gyroscope", Method(&Slam::Gyroscope), doc::Slam_Gyroscope)
      .def("imu", Method(&Slam::Imu), doc::Slam_Imu)
      .def(
          "save",
          [](ExclusiveSlam& self, const PathText& path) {
            self.Use([&](Slam& s) { s.Save(path); });
          },
          py::arg("path"), doc::Slam_Save)
      .def(
          "load",
          [](ExclusiveSlam& self, const std::variant<MapSnapshot, PathText>& map, int submap) {
            self.Use([&](Slam& s) {
              if (const auto* path = std::get_if<PathText>(&map))
                s.Load(*path, submap);
              else
                s.Load(std::get<MapSnapshot>(map));
            });
          },
          py::arg("map"), py::arg("submap") = 0, doc::Slam_Load)
      .def("reset", Method(&Slam::Reset), doc::Slam_Reset);
}

}  // namespace

void AddSlam(py::module_& m) {
  PYBIND11_NUMPY_DTYPE(TrackedPointRow, pixel, sigma_px, landmark, position);
  SlamClass slam(m, "Slam", doc::Slam);
  AddTracking(slam);
  AddRelocalize<ExclusiveSlam>(slam, doc::Slam_Relocalize);
  AddMapping(slam);
}

void AddMapLocalizer(py::module_& m) {
  py::class_<MapLocalizer, std::shared_ptr<MapLocalizer>> localizer(m, "MapLocalizer",
                                                                    doc::MapLocalizer);
  localizer
      .def(py::init([](const std::variant<MapSnapshot, PathText>& map, const SlamConfig& config) {
             if (const auto* path = std::get_if<PathText>(&map))
               return MakeWithoutGil<MapLocalizer>(*path, config);
             return MakeWithoutGil<MapLocalizer>(std::get<MapSnapshot>(map), config);
           }),
           py::arg("map"), py::arg("config") = SlamConfig::Offline(),
           doc::MapLocalizer_MapLocalizer)
      .def_property_readonly("map", &MapLocalizer::map, doc::MapLocalizer_map);
  AddRelocalize<const MapLocalizer>(localizer, doc::MapLocalizer_Relocalize);
}

}  // namespace oaslam::python
