#include "oaslam/camera.h"

#include <limits>

#include "bindings.h"
#include "exclusive.h"
#include "oaslam/camera_estimation.h"
#include "oaslam/camera_file.h"

namespace oaslam::python {
namespace {

Camera MakeCamera(LensModel model, int width, int height, double fx, double fy, double cx,
                  double cy, const std::vector<double>& distortion, bool is_guess,
                  double focal_sigma, const std::string& name) {
  Camera camera{model, width, height, fx, fy, cx, cy, {}, is_guess, name, focal_sigma};
  if (distortion.size() > camera.distortion.size())
    throw py::value_error("a camera has at most 5 numbers of distortion, not " +
                          std::to_string(distortion.size()));
  std::ranges::copy(distortion, camera.distortion.begin());
  return camera;
}

constexpr const char* kManyPoints =
    "\n\nOf one point, or of many in the rows of an array. Nothing is NaN.";
using Points = py::array_t<double, py::array::c_style | py::array::forcecast>;

// Calls a function of each row of an array of one or two dimensions.
template <int kIn, int kOut, typename Function>
py::array_t<double> OfEachRow(const Points& points, Function&& function) {
  using In = Eigen::Matrix<double, kIn, 1>;
  using Out = Eigen::Matrix<double, kOut, 1>;
  const py::ssize_t dimensions = points.ndim();
  if (dimensions < 1 || dimensions > 2 || points.shape(dimensions - 1) != kIn)
    throw py::value_error("expected " + std::to_string(kIn) + " numbers, or rows of so many");
  std::vector<py::ssize_t> shape(points.shape(), points.shape() + dimensions);
  shape.back() = kOut;
  py::array_t<double> result(shape);
  for (py::ssize_t i = 0; i < points.size() / kIn; ++i)
    Eigen::Map<Out>(result.mutable_data() + kOut * i) =
        function(In(Eigen::Map<const In>(points.data() + kIn * i)))
            .value_or(Out::Constant(std::numeric_limits<double>::quiet_NaN()));
  return result;
}

py::array_t<double> Project(const Camera& camera, const Points& in_cam) {
  return OfEachRow<3, 2>(in_cam, [&](const Eigen::Vector3d& x) { return camera.Project(x); });
}

py::array_t<double> Lift(const Camera& camera, const Points& pixel) {
  return OfEachRow<2, 3>(pixel, [&](const Eigen::Vector2d& p) { return camera.Lift(p); });
}

std::string ReprOf(const Camera& c) {
  return py::str("Camera({}, {}x{}, fx={}, fy={}, cx={}, cy={}, distortion={})")
      .format(c.model, c.width, c.height, c.fx, c.fy, c.cx, c.cy,
              py::tuple(py::cast(c.distortion)));
}

}  // namespace

void AddCameras(py::module_& m) {
  auto lens = py::enum_<LensModel>(m, "LensModel", doc::LensModel)
                  .value("PINHOLE", LensModel::kPinhole, doc::LensModel_kPinhole)
                  .value("FISHEYE", LensModel::kFisheye, doc::LensModel_kFisheye);
  SayAsToString(lens);
  Value<Camera>(m, "Camera", doc::Camera)
      .def(py::init(&MakeCamera), py::kw_only(), py::arg("model") = LensModel::kPinhole,
           py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"), py::arg("cx"),
           py::arg("cy"), py::arg("distortion") = py::tuple(), py::arg("is_guess") = false,
           py::arg("focal_sigma") = 0, py::arg("name") = "", doc::Camera)
      .def_readwrite(OASLAM_FIELD(Camera, model))
      .def_readwrite(OASLAM_FIELD(Camera, width))
      .def_readwrite(OASLAM_FIELD(Camera, height))
      .def_readwrite(OASLAM_FIELD(Camera, fx))
      .def_readwrite(OASLAM_FIELD(Camera, fy))
      .def_readwrite(OASLAM_FIELD(Camera, cx))
      .def_readwrite(OASLAM_FIELD(Camera, cy))
      .keep("distortion", &Camera::distortion)
      .def_property(
          "distortion", [](const Camera& c) { return py::tuple(py::cast(c.distortion)); },
          [](Camera& c, const std::array<double, 5>& d) { c.distortion = d; },
          doc::Camera_distortion)
      .def_readwrite(OASLAM_FIELD(Camera, is_guess))
      .def_readwrite(OASLAM_FIELD(Camera, focal_sigma))
      .def_readwrite(OASLAM_FIELD(Camera, name))
      .def("has_distortion", &Camera::HasDistortion, doc::Camera_HasDistortion)
      .def("project", &Project, py::arg("in_cam"),
           (std::string(doc::Camera_Project) + kManyPoints).c_str())
      .def("lift", &Lift, py::arg("pixel"), (std::string(doc::Camera_Lift) + kManyPoints).c_str())
      .def("__repr__", &ReprOf);
  m.def(
      "load_camera",
      [](const PathText& spec, const std::pair<int, int>& image_size) {
        return LoadCamera(spec, {image_size.first, image_size.second});
      },
      py::arg("spec"), py::arg("image_size") = std::pair(0, 0), WithoutGil(), doc::LoadCamera);
  m.def("check_calibration", &CheckCalibration, py::arg("camera"), py::arg("where"),
        doc::CheckCalibration);
  m.def("camera_text", &CameraText, py::arg("camera"), py::arg("note") = "", doc::CameraText);
}

void AddCameraEstimation(py::module_& m) {
  Value<CameraEstimate>(m, "CameraEstimate", doc::CameraEstimate)
      .def_readonly(OASLAM_FIELD(CameraEstimate, camera))
      .def_readonly(OASLAM_FIELD(CameraEstimate, is_determined))
      .def_readonly(OASLAM_FIELD(CameraEstimate, focal_sigma_px))
      .def_readonly(OASLAM_FIELD(CameraEstimate, why_not))
      .def_readonly(OASLAM_FIELD(CameraEstimate, readout_s))
      .def_readonly(OASLAM_FIELD(CameraEstimate, images))
      .def_readonly(OASLAM_FIELD(CameraEstimate, rmse));
  using Estimator = Exclusive<CameraEstimator>;
  py::class_<Estimator, std::shared_ptr<Estimator>>(m, "CameraEstimator", doc::CameraEstimator)
      .def(py::init([](const SlamConfig& config, const std::optional<Camera>& start,
                       std::optional<double> focal_length_35mm) {
             return MakeWithoutGil<Estimator>(config,
                                              CameraEstimationOptions{start, focal_length_35mm});
           }),
           py::arg("config") = SlamConfig::Offline(), py::kw_only(),
           py::arg("start") = std::nullopt, py::arg("focal_length_35mm") = std::nullopt,
           doc::CameraEstimator)
      .def("add", Method(&CameraEstimator::Add), py::arg("image"), py::arg("timestamp"),
           doc::CameraEstimator_Add)
      .def("duration", Method(&CameraEstimator::Duration), doc::CameraEstimator_Duration)
      .def("is_full", Method(&CameraEstimator::IsFull), doc::CameraEstimator_IsFull)
      .def("estimate", Method(&CameraEstimator::Estimate), doc::CameraEstimator_Estimate)
      .def("forget", Method(&CameraEstimator::Forget), doc::CameraEstimator_Forget);
  m.def("describe", &Describe, py::arg("estimate"), doc::Describe);
}

}  // namespace oaslam::python
