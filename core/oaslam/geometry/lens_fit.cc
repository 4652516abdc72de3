#include "oaslam/geometry/lens_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

struct Sample {
  Eigen::Vector2d ray, pixel;  // x and y where z = 1; px
  double weight;               // samples lie on lines from the centre, closer together there
};

// Samples from the principal point outward, as far as the image goes and the lens is one to one.
std::vector<Sample> SamplesOf(const LensFunction& lens, const Camera& frame) {
  constexpr int kDirections = 16, kSamples = 32;     // of each side; of each direction
  constexpr double kStep = 1e-3, kMostAngle = 1.54;  // rad; a ray at 1.5708 meets no pinhole image
  const auto direction = [](double angle, const Eigen::Vector2d& side) {
    return Eigen::Vector3d(std::sin(angle) * side.x(), std::sin(angle) * side.y(), std::cos(angle));
  };
  const auto pixel = [&](const Eigen::Vector3d& d) -> Eigen::Vector2d {
    return lens(d).cwiseProduct(Eigen::Vector2d(frame.fx, frame.fy)) +
           Eigen::Vector2d(frame.cx, frame.cy);
  };
  const auto is_inside = [&](const Eigen::Vector2d& p) {
    return p.x() >= -0.5 && p.y() >= -0.5 && p.x() <= frame.width - 0.5 &&
           p.y() <= frame.height - 0.5;
  };
  std::vector<Sample> samples;
  const auto add = [&](double x, double y) {
    const Eigen::Vector2d side =
        Eigen::Vector2d((x - frame.cx) / frame.fx, (y - frame.cy) / frame.fy).normalized();
    double end = 0, radius = -1;
    for (double angle = 0; angle < kMostAngle; angle += kStep) {
      const Eigen::Vector3d d = direction(angle, side);
      const double next = lens(d).norm();
      if (!(next > radius) || !is_inside(pixel(d))) break;
      end = angle, radius = next;
    }
    for (int i = 0; i <= kSamples; ++i) {
      const Eigen::Vector3d d = direction(end * i / kSamples, side);
      samples.push_back({d.head<2>() / d.z(), pixel(d), std::sqrt((i + 1.0) / kSamples)});
    }
  };
  for (int i = 0; i < kDirections; ++i) {
    const double u = static_cast<double>(i) / kDirections, w = frame.width, h = frame.height;
    add(u * w, 0), add(w, u * h), add(w - u * w, h), add(0, h - u * h);
  }
  return samples;
}

// The parameters of a camera that a fit changes.
std::vector<double*> ParametersOf(Camera& camera) {
  std::vector<double*> parameters{&camera.fx, &camera.fy, &camera.cx, &camera.cy};
  const size_t count = camera.model == LensModel::kFisheye ? 4 : 5;
  for (size_t i = 0; i < count; ++i) parameters.push_back(&camera.distortion[i]);
  return parameters;
}

Eigen::Vector2d Project(const Camera& camera, const Eigen::Vector2d& ray) {
  return Distort(camera, {camera.fx * ray.x() + camera.cx, camera.fy * ray.y() + camera.cy});
}

double MaxErrorOf(const std::vector<Sample>& samples, const Camera& camera) {
  double most = 0;
  for (const Sample& sample : samples) {
    const double error = (Project(camera, sample.ray) - sample.pixel).norm();
    if (!(error <= most))
      most = std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
  }
  return most;
}

// Gauss-Newton, which needs few steps: but for p1 and p2 the models are linear in products of
// parameters. Then samples with large errors get more weight (Lawson 1961), so that the largest
// error becomes small.
LensFit FitTo(std::vector<Sample> samples, Camera camera) {
  constexpr int kIterations = 20, kUnweighted = 5;
  LensFit best{camera, std::numeric_limits<double>::infinity()};
  constexpr double kExact = 1e-6, kLeastShare = 1e-3;  // px; of the largest error
  const std::vector<double*> parameters = ParametersOf(camera);
  const auto count = static_cast<Eigen::Index>(parameters.size());
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(count, count);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(count);
    Eigen::Matrix2Xd jacobian(2, count);
    for (const Sample& sample : samples) {
      for (Eigen::Index i = 0; i < count; ++i) {
        double& parameter = *parameters[static_cast<size_t>(i)];
        const double value = parameter, step = 1e-5 * std::max(1.0, std::abs(value));
        parameter = value + step;
        const Eigen::Vector2d above = Project(camera, sample.ray);
        parameter = value - step;
        jacobian.col(i) = sample.weight * (above - Project(camera, sample.ray)) / (2 * step);
        parameter = value;
      }
      normal += jacobian.transpose() * jacobian;
      gradient +=
          jacobian.transpose() * (sample.weight * (sample.pixel - Project(camera, sample.ray)));
    }
    // Scaled to a diagonal of ones, since focal lengths and coefficients differ by powers of ten.
    const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt().cwiseMax(1e-12).cwiseInverse();
    normal = scale.asDiagonal() * normal * scale.asDiagonal();
    normal.diagonal().array() += 1e-13;
    const Eigen::VectorXd step =
        scale.cwiseProduct(normal.ldlt().solve(scale.cwiseProduct(gradient)));
    if (!step.allFinite()) break;
    for (Eigen::Index i = 0; i < count; ++i) *parameters[static_cast<size_t>(i)] += step(i);
    const double error = MaxErrorOf(samples, camera);
    if (error < best.max_error_px) best = {camera, error};
    if (iteration < kUnweighted || !(error > kExact) || !std::isfinite(error)) continue;
    for (Sample& sample : samples)
      sample.weight *=
          std::sqrt((Project(camera, sample.ray) - sample.pixel).norm() / error + kLeastShare);
  }
  return best;
}

}  // namespace

LensFit FitLens(const LensFunction& lens, const Camera& frame) {
  Camera start = frame;
  start.distortion = {};
  constexpr double kSmall = 1e-4;  // rad: where the lens is a pinhole of the focal length sought
  const double magnification = lens({kSmall, 0, 1}).x() / kSmall;
  if (!std::isfinite(magnification) || magnification <= 0)
    return {start, std::numeric_limits<double>::infinity()};
  start.fx *= magnification;
  start.fy *= magnification;
  const std::vector<Sample> samples = SamplesOf(lens, frame);
  double most = 0;  // tangent of the largest angle
  for (const Sample& sample : samples) most = std::max(most, sample.ray.norm());
  constexpr double kMostPinhole = 3;  // beyond it (72 degrees) powers of it are no use
  LensFit best{start, std::numeric_limits<double>::infinity()};
  for (const LensModel model : {LensModel::kPinhole, LensModel::kFisheye}) {
    if (model == LensModel::kPinhole && most > kMostPinhole) continue;
    start.model = model;
    const LensFit fit = FitTo(samples, start);
    if (fit.max_error_px < best.max_error_px) best = fit;
  }
  return best;
}

}  // namespace oaslam
