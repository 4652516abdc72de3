#include "oaslam/slam.h"

#include "bindings.h"
#include "exclusive.h"
#include "oaslam/image_localizer.h"
#include "rows.h"

namespace oaslam::python {
namespace {

using ExclusiveSlam = Exclusive<Slam>;
using OptionalPose = std::optional<Rigid3>;
using OptionalVector = std::optional<Eigen::Vector3d>;
using Detections = std::vector<Detection>;

// The members of an ImageInput as arguments.
std::string WithImageDocs(const char* text, bool in_sequence) {
  const auto line = [](const char* name, const char* comment) {
    return std::string("\n") + name + ": " + comment;
  };
  return std::string(text) + "\n" + line("image", doc::ImageInput_image) +
         (in_sequence ? line("timestamp", doc::ImageInput_timestamp) : "") +
         line("detections", doc::ImageInput_detections) +
         (in_sequence ? line("detections_follow", doc::ImageInput_detections_follow) : "") +
         line("gravity_in_cam", doc::ImageInput_gravity_in_cam) +
         (in_sequence ? line("angular_velocity", doc::ImageInput_angular_velocity) : "");
}

TrackingResult Process(ExclusiveSlam& slam, const cv::Mat& image, double timestamp,
                       const Detections& detections, bool detections_follow,
                       const OptionalVector& gravity_in_cam,
                       const std::vector<std::array<double, 4>>& angular_velocity) {
  ImageInput input{image, timestamp, detections, detections_follow, gravity_in_cam, {}};
  for (const auto& [time, x, y, z] : angular_velocity)
    input.angular_velocity.push_back({time, {x, y, z}});
  return slam.Use([&](Slam& s) { return s.Process(input); });
}

ImageInput SingleImage(const std::optional<cv::Mat>& image, const Detections& detections,
                       const OptionalVector& gravity_in_cam) {
  return {image.value_or(cv::Mat()), 0, detections, false, gravity_in_cam, {}};
}

RelocalizationResult Relocalize(ExclusiveSlam& slam, const cv::Mat& image, RelocalizationMode mode,
                                const OptionalPose& prior, const Detections& detections,
                                const OptionalVector& gravity_in_cam) {
  return slam.Use([&](Slam& s) {
    return s.Relocalize(SingleImage(image, detections, gravity_in_cam), mode, prior);
  });
}

RelocalizationResult RelocalizeWithUnknownCamera(ExclusiveSlam& slam, const cv::Mat& image,
                                                 RelocalizationMode mode,
                                                 const Detections& detections,
                                                 const OptionalVector& gravity_in_cam) {
  return slam.Use([&](Slam& s) {
    return s.RelocalizeWithUnknownCamera(SingleImage(image, detections, gravity_in_cam), mode);
  });
}

py::array_t<TrackedPointRow> TrackedPoints(ExclusiveSlam& slam) {
  std::vector<TrackedPointRow> rows;
  for (const TrackedPoint& p : slam.Use([](Slam& s) { return s.TrackedPoints(); }))
    rows.push_back({{p.pixel.x(), p.pixel.y()},
                    p.sigma_px,
                    p.landmark ? int64_t{*p.landmark} : -1,
                    {p.position.x(), p.position.y(), p.position.z()}});
  return ArrayOfRows(std::move(rows));
}

AnchorReport PlaceAnchor(ExclusiveSlam& slam, const std::string& name, const std::string& model,
                         const OptionalVector& origin, const OptionalVector& direction,
                         std::optional<uint32_t> object, double size, const OptionalPose& pose) {
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  return slam.Use([&](Slam& s) {
    return s.PlaceAnchor(
        {name, model, origin.value_or(none), direction.value_or(none), object, size, pose});
  });
}

std::string EditAnchor(ExclusiveSlam& slam, const std::string& anchor,
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
           WithImageDocs(doc::Slam_Process, true).c_str())
      .def("add_detections", Method(&Slam::AddDetections), py::arg("frame"), py::arg("detections"),
           doc::Slam_AddDetections)
      .def("relocalize", &Relocalize, py::arg("image"), py::arg("mode"),
           py::arg("prior") = std::nullopt, py::kw_only(), py::arg("detections") = py::tuple(),
           py::arg("gravity_in_cam") = std::nullopt,
           WithImageDocs(doc::Slam_Relocalize, false).c_str())
      .def("relocalize_with_unknown_camera", &RelocalizeWithUnknownCamera, py::arg("image"),
           py::arg("mode"), py::kw_only(), py::arg("detections") = py::tuple(),
           py::arg("gravity_in_cam") = std::nullopt,
           WithImageDocs(doc::Slam_RelocalizeWithUnknownCamera, false).c_str())
      .def("relocalize_by_objects", Method(&Slam::RelocalizeByObjects), py::arg("detections"),
           py::arg("gravity_in_cam") = std::nullopt, doc::Slam_RelocalizeByObjects)
      .def("follow_by_objects", Method(&Slam::FollowByObjects), py::arg("timestamp"),
           py::arg("detections"), py::arg("gravity_in_cam") = std::nullopt,
           doc::Slam_FollowByObjects)
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
      .def("set_metres_per_unit", Method(&Slam::SetMetresPerUnit), py::arg("metres"),
           doc::Slam_SetMetresPerUnit)
      .def("anchors", Method(&Slam::Anchors), doc::Slam_Anchors)
      .def("place_anchor", &PlaceAnchor, py::kw_only(), py::arg("name") = "", py::arg("model") = "",
           py::arg("origin") = std::nullopt, py::arg("direction") = std::nullopt,
           py::arg("object") = std::nullopt, py::arg("size") = 0, py::arg("pose") = std::nullopt,
           (std::string(doc::Slam_PlaceAnchor) + "\n\n" + doc::AnchorRequest).c_str())
      .def("edit_anchor", &EditAnchor, py::arg("anchor"), py::kw_only(),
           py::arg("name") = std::nullopt, py::arg("model") = std::nullopt,
           py::arg("size") = std::nullopt, py::arg("turn_rad") = 0, py::arg("pose") = std::nullopt,
           doc::Slam_EditAnchor)
      .def("remove_anchor", Method(&Slam::RemoveAnchor), py::arg("name"), doc::Slam_RemoveAnchor)
      .def("snapshot", Method(&Slam::Snapshot), doc::Slam_Snapshot)
      .def("trajectory", Method(&Slam::Trajectory), doc::Slam_Trajectory)
      .def("finish", Method(&Slam::Finish), doc::Slam_Finish)
      .def("main_piece", Method(&Slam::MainPiece), doc::Slam_MainPiece)
      .def(
          "save",
          [](ExclusiveSlam& self, const PathText& path) {
            self.Use([&](Slam& s) { s.Save(path); });
          },
          py::arg("path"), doc::Slam_Save)
      .def(
          "load",
          [](ExclusiveSlam& self, const PathText& path, int piece) {
            self.Use([&](Slam& s) { s.Load(path, piece); });
          },
          py::arg("path"), py::arg("piece") = 0, doc::Slam_Load)
      .def("reset", Method(&Slam::Reset), doc::Slam_Reset);
}

}  // namespace

void AddSlam(py::module_& m) {
  PYBIND11_NUMPY_DTYPE(TrackedPointRow, pixel, sigma_px, landmark, position);
  SlamClass slam(m, "Slam", doc::Slam);
  AddTracking(slam);
  AddMapping(slam);
}

void AddImageLocalizer(py::module_& m) {
  py::class_<ImageLocalizer, std::shared_ptr<ImageLocalizer>>(m, "ImageLocalizer",
                                                              doc::ImageLocalizer)
      .def(py::init([](const PathText& map_path, const SlamConfig& config, int piece) {
             return MakeWithoutGil<ImageLocalizer>(map_path, config, piece);
           }),
           py::arg("map_path"), py::arg("config") = SlamConfig{}, py::arg("piece") = 0,
           doc::ImageLocalizer_ImageLocalizer)
      .def(
          "localize",
          [](const ImageLocalizer& localizer, const std::optional<cv::Mat>& image,
             const Camera& camera, RelocalizationMode mode, const OptionalPose& prior,
             const Detections& detections, const OptionalVector& gravity_in_cam) {
            return localizer.Localize(SingleImage(image, detections, gravity_in_cam), camera, mode,
                                      prior);
          },
          py::arg("image"), py::arg("camera"), py::arg("mode"), py::arg("prior") = std::nullopt,
          py::kw_only(), py::arg("detections") = py::tuple(),
          py::arg("gravity_in_cam") = std::nullopt, WithoutGil(),
          WithImageDocs(doc::ImageLocalizer_Localize, false).c_str())
      .def(
          "localize_with_unknown_camera",
          [](const ImageLocalizer& localizer, const cv::Mat& image, RelocalizationMode mode,
             const Detections& detections, const OptionalVector& gravity_in_cam) {
            return localizer.LocalizeWithUnknownCamera(
                SingleImage(image, detections, gravity_in_cam), mode);
          },
          py::arg("image"), py::arg("mode"), py::kw_only(), py::arg("detections") = py::tuple(),
          py::arg("gravity_in_cam") = std::nullopt, WithoutGil(),
          WithImageDocs(doc::ImageLocalizer_LocalizeWithUnknownCamera, false).c_str())
      .def("snapshot", &ImageLocalizer::Snapshot, WithoutGil(), doc::ImageLocalizer_Snapshot);
}

}  // namespace oaslam::python
