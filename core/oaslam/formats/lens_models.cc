#include "oaslam/formats/lens_models.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "oaslam/camera_file.h"
#include "oaslam/formats/yaml.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/lower.h"

namespace oaslam {
namespace {

constexpr const char* kWhatToDo =
    "undistort the images with the tool that made the calibration, or calibrate as "
    "radial-tangential or fisheye, or use --camera auto";

constexpr std::pair<const char*, LensModel> kLensNames[] = {
    {"plumb_bob", LensModel::kPinhole},
    {"rational_polynomial", LensModel::kPinhole},
    {"radtan", LensModel::kPinhole},
    {"radial-tangential", LensModel::kPinhole},
    {"radialtangential", LensModel::kPinhole},
    {"radialtangential8", LensModel::kPinhole},
    {"none", LensModel::kPinhole},
    {"pinhole", LensModel::kPinhole},
    {"pinhole_full", LensModel::kPinhole},
    {"perspective", LensModel::kPinhole},
    {"opencv", LensModel::kPinhole},
    {"simple_pinhole", LensModel::kPinhole},
    {"simple_radial", LensModel::kPinhole},
    {"radial", LensModel::kPinhole},
    {"", LensModel::kPinhole},
    {"equidistant", LensModel::kFisheye},
    {"equidist", LensModel::kFisheye},
    {"fisheye", LensModel::kFisheye},
    {"opencv_fisheye", LensModel::kFisheye},
    {"kannalabrandt8", LensModel::kFisheye},
    {"kannala_brandt4", LensModel::kFisheye},
    {"kannala_brandt", LensModel::kFisheye}};

// OpenCV's model: rational, tangential and thin prism, then a tilted sensor.
LensFunction OpenCvLens(std::span<const double> values) {
  std::vector<double> k(values.begin(), values.end());
  k.resize(14, 0.0);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(-k[13], Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(-k[12], Eigen::Vector3d::UnitX()));
  Eigen::Matrix3d sensor = Eigen::Matrix3d::Identity();
  sensor << turn(2, 2), 0, -turn(0, 2), 0, turn(2, 2), -turn(1, 2), 0, 0, 1;
  const Eigen::Matrix3d tilt = sensor * turn;
  return [k, tilt](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    const double x = d.x() / d.z(), y = d.y() / d.z(), r2 = x * x + y * y;
    const double radial =
        (1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
    const Eigen::Vector3d flat(
        x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x) + r2 * (k[8] + r2 * k[9]),
        y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y + r2 * (k[10] + r2 * k[11]), 1);
    return (tilt * flat).hnormalized();
  };
}

}  // namespace

LensModel LensModelOf(const std::string& name, const LensPlace& place) {
  const std::string word = Lower(name);
  for (const auto& [known, model] : kLensNames)
    if (word == known) return model;
  throw BadInput(
      "{}: {}: {}, a lens model that is not known here, allowed: radial-tangential (plumb_bob, "
      "radtan, perspective) | fisheye (equidistant); {}",
      place.path, place.key, TextOfNode(YAML::Node(name)),
      word == "equirectangular" ? "cut views out of the panorama (FFmpeg's filter v360)"
                                : kWhatToDo);
}

void SetDistortion(Camera& camera, std::span<const double> values, const LensPlace& place) {
  const bool is_fisheye = camera.model == LensModel::kFisheye;
  const size_t used = is_fisheye ? 4 : 5, known = is_fisheye ? 4 : 14;
  if (values.size() == 1 || (is_fisheye && !values.empty() && values.size() < 4))
    throw BadInput("{}: {}: {} values, expected {}", place.path, place.key, values.size(), used);
  const auto is_zero = [](double value) { return value == 0; };
  for (size_t i = known; i < values.size(); ++i)
    if (!is_zero(values[i]))
      throw BadInput("{}: {}[{}]: {}, only {} coefficients are known", place.path, place.key, i,
                     values[i], known);
  if (values.size() > used && !std::ranges::all_of(values.subspan(used), is_zero))
    return SetLens(camera, OpenCvLens(values.first(std::min(values.size(), known))),
                   "rational / thin prism", place);
  for (size_t i = 0; i < std::min(values.size(), used); ++i) camera.distortion[i] = values[i];
}

void SetLens(Camera& camera, const LensFunction& lens, const std::string& name,
             const LensPlace& place) {
  constexpr double kMostPx = 0.05;  // well below what a calibration, and a key point, is sure of
  if (camera.width == 0 && camera.height == 0) {
    camera.width = place.image_size.width;
    camera.height = place.image_size.height;
  }
  if (camera.width == 0)
    throw BadInput("{}: has no image size, and there are no images to take it from", place.path);
  CheckCalibration(camera, place.path);
  const LensFit fit = FitLens(lens, camera);
  const char* ours = fit.camera.model == LensModel::kFisheye ? "fisheye" : "radial-tangential";
  if (!(fit.max_error_px <= kMostPx))
    throw BadInput(
        "{}: {}: lens model {}: the closest {} lens differs by {:.2g} px, allowed: {}; {}",
        place.path, place.key, name, ours, fit.max_error_px, kMostPx, kWhatToDo);
  Log(LogLevel::kInfo, "{}: lens model {} converted to {}, differs by at most {:.2g} px",
      place.path, name, ours, fit.max_error_px);
  camera = fit.camera;
}

LensFunction OmniLens(double xi, std::span<const double> radtan) {
  const LensFunction distorted = OpenCvLens(radtan);
  return [xi, distorted](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    return distorted({d.x(), d.y(), d.z() + xi * d.norm()});
  };
}

LensFunction DoubleSphereLens(double xi, double alpha) {
  return [xi, alpha](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    const double z = xi * d.norm() + d.z();
    return d.head<2>() / (alpha * std::hypot(d.head<2>().norm(), z) + (1 - alpha) * z);
  };
}

LensFunction ExtendedUnifiedLens(double alpha, double beta) {
  return [alpha, beta](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    const double distance = std::sqrt(beta * d.head<2>().squaredNorm() + d.z() * d.z());
    return d.head<2>() / (alpha * distance + (1 - alpha) * d.z());
  };
}

LensFunction FieldOfViewLens(double omega) {
  return [omega](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    const double r = d.head<2>().norm() / d.z();
    if (r < 1e-12 || omega == 0) return d.head<2>() / d.z();
    return d.head<2>() / d.z() * (std::atan(2 * r * std::tan(omega / 2)) / (omega * r));
  };
}

LensFunction ThinPrismFisheyeLens(std::span<const double> coefficients) {
  std::vector<double> k(coefficients.begin(), coefficients.end());
  k.resize(8, 0.0);
  return [k](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    const double r = d.head<2>().norm();
    if (r < 1e-12) return {0, 0};
    const Eigen::Vector2d p = d.head<2>() * (std::atan2(r, d.z()) / r);
    const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
    const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * (k[4] + r2 * k[5])));
    return {x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x) + k[6] * r2,
            y * radial + 2 * k[3] * x * y + k[2] * (r2 + 2 * y * y) + k[7] * r2};
  };
}

LensFunction FourRadialLens(std::span<const double> k, double p1, double p2) {
  const std::vector<double> radial(k.begin(), k.end());
  return [radial, p1, p2](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    const double x = d.x() / d.z(), y = d.y() / d.z(), r2 = x * x + y * y;
    double factor = 0;
    for (size_t i = radial.size(); i-- > 0;) factor = r2 * (radial[i] + factor);
    return {x * (1 + factor) + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
            y * (1 + factor) + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
  };
}

}  // namespace oaslam
