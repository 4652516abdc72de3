#include "oaslam/estimation/ellipsoid_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "oaslam/estimation/ellipsoid_residuals.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Bounds of the half axes as a share of the distance from the cameras, which is the only known
// length: at 1.5 m, 8 mm and 1.6 m.
constexpr double kMinAxisPerDepth = 0.005, kMaxAxisPerDepth = 1.1;

double MedianDistance(std::span<const BoxView> views, const Eigen::Vector3d& center) {
  std::vector<double> depths;
  for (const BoxView& view : views) depths.push_back(std::abs((view.cam_from_world * center).z()));
  return Median(std::move(depths));
}

void ClampAxes(Ellipsoid& ellipsoid, double depth) {
  ellipsoid.half_axes =
      ellipsoid.half_axes.cwiseMax(kMinAxisPerDepth * depth).cwiseMin(kMaxAxisPerDepth * depth);
}

struct Ray {
  Eigen::Vector3d origin, direction;
};

std::vector<Ray> CenterRays(std::span<const BoxView> views) {
  std::vector<Ray> rays;
  rays.reserve(views.size());
  for (const BoxView& view : views)
    rays.push_back(
        {view.cam_from_world.OriginInSource(),
         (view.cam_from_world.rotation.conjugate() * RayOf(*view.camera, CenterPixel(view.box)))
             .normalized()});
  return rays;
}

double LargestAngleDeg(std::span<const Ray> rays) {
  double smallest_cosine = 1;
  for (size_t i = 0; i < rays.size(); ++i)
    for (size_t j = i + 1; j < rays.size(); ++j)
      smallest_cosine = std::min(smallest_cosine, rays[i].direction.dot(rays[j].direction));
  return std::acos(std::clamp(smallest_cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

// Minimises the squared distances to the rays, each divided by its depth since errors are angular.
Eigen::Vector3d NearestPoint(std::span<const Ray> rays) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (int pass = 0; pass < 3; ++pass) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (const Ray& ray : rays) {
      const double depth = pass == 0 ? 1 : std::max((point - ray.origin).norm(), 1e-12);
      const Eigen::Matrix3d across =
          (Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose()) /
          (depth * depth);
      a += across;
      b += across * ray.origin;
    }
    point = a.ldlt().solve(b);
  }
  return point;
}

// A sphere that fills the boxes and has its surface where it was measured.
std::optional<Ellipsoid> SphereBySurfaces(std::span<const BoxView> views) {
  constexpr int kLeast = 3;
  constexpr double kWidest = 1;  // half a box, times its distance
  int count = 0;
  Ellipsoid sphere{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (const BoxView& view : views) {
    const double half =
        (view.box.Width() / view.camera->fx + view.box.Height() / view.camera->fy) / 4;
    if (!(view.surface > 0) || view.truncated || !(half < kWidest)) continue;
    const double z = view.surface / (1 - kFrontOfCenter * half);
    sphere.center +=
        view.cam_from_world.Inverse() * (z * RayOf(*view.camera, CenterPixel(view.box))).eval();
    sphere.half_axes.array() += z * half;
    ++count;
  }
  if (count < kLeast) return std::nullopt;
  sphere.center /= count;
  sphere.half_axes /= count;
  return sphere;
}

// The boxes of an object, for MinimizeLevenbergMarquardt.
struct BoxProblem {
  std::span<const BoxView> views;
  const EllipsoidFitOptions& options;
  int parameters;
  double depth;  // of the object; bounds its axes
  EllipsoidEquations equations{};

  double Cost(const Ellipsoid& ellipsoid) const { return EvaluateCost(views, ellipsoid, options); }
  void Linearize(const Ellipsoid& ellipsoid) {
    equations = oaslam::Linearize(views, ellipsoid, options);
  }
  bool Step(double damping, Ellipsoid& ellipsoid) const {
    if (equations.in_front == 0) return false;
    using Bounded = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kShapeParameters,
                                  kShapeParameters>;
    Bounded damped = equations.hessian.topLeftCorner(parameters, parameters);
    // Rotations of a sphere have no effect on the cost: this floor keeps them from changing.
    const double floor = 1e-9 * damped.diagonal().maxCoeff();
    damped.diagonal() += (damping * damped.diagonal().array() + floor).matrix();
    ShapeVector step = ShapeVector::Zero();
    step.head(parameters) = -damped.ldlt().solve(equations.gradient.head(parameters));
    if (!step.allFinite()) return false;
    // The projection is not linear in a half axis that changes by more than a factor of e.
    step.segment<3>(3) = step.segment<3>(3).cwiseMax(-1.0).cwiseMin(1.0);
    ellipsoid = Moved(ellipsoid, step);
    ClampAxes(ellipsoid, depth);
    return true;
  }
};

}  // namespace

SphereEstimate EstimateSphere(std::span<const BoxView> all_views, double min_parallax_deg) {
  SphereEstimate result;
  // The centre of a truncated box is not the centre of the object.
  std::vector<BoxView> views;
  for (const BoxView& view : all_views)
    if (!view.truncated) views.push_back(view);
  if (views.size() < 3) views.assign(all_views.begin(), all_views.end());
  if (views.size() < 2) return result;
  const std::vector<Ray> rays = CenterRays(views);
  result.parallax_deg = LargestAngleDeg(rays);
  if (result.parallax_deg < min_parallax_deg) {
    const std::optional<Ellipsoid> by_surfaces = SphereBySurfaces(views);
    if (by_surfaces) result = {true, *by_surfaces, result.parallax_deg};
    return result;
  }
  result.sphere.center = NearestPoint(rays);
  double radius = 0;
  for (const BoxView& view : views) {
    const double z = (view.cam_from_world * result.sphere.center).z();
    if (!(z > 0)) return result;
    radius += z / 2 * (view.box.Width() / view.camera->fx + view.box.Height() / view.camera->fy);
  }
  radius /= 2 * static_cast<double>(views.size());
  result.sphere.half_axes.setConstant(radius);
  ClampAxes(result.sphere, MedianDistance(views, result.sphere.center));
  result.success = result.sphere.center.allFinite() && radius > 0;
  return result;
}

ViewOverlap MeasureOverlap(const Ellipsoid& ellipsoid, std::span<const BoxView> views,
                           double accept_iou) {
  double all = 0, whole = 0;
  int accepted = 0, whole_count = 0;
  for (const BoxView& view : views) {
    const auto predicted = ProjectToBox(ellipsoid, view.cam_from_world, *view.camera);
    const double iou =
        predicted ? IoU(ClipAtTruncation(*predicted, view.box, view.truncated), view.box) : 0;
    accepted += iou >= accept_iou;
    all += iou;
    if (view.truncated) continue;
    whole += iou;
    ++whole_count;
  }
  if (views.empty()) return {};
  const double count = static_cast<double>(views.size());
  return {whole_count > 0 ? whole / whole_count : all / count, accepted / count};
}

Ellipsoid MakeUpright(const Ellipsoid& ellipsoid, const Eigen::Vector3d& up) {
  const Eigen::Matrix3d axes = ellipsoid.rotation.toRotationMatrix();
  Eigen::Index nearest = 0;
  (axes.transpose() * up).cwiseAbs().maxCoeff(&nearest);
  Ellipsoid upright = ellipsoid;
  for (Eigen::Index i = 0; i < 3; ++i)
    upright.half_axes[i] = ellipsoid.half_axes[(nearest + 1 + i) % 3];
  Eigen::Matrix3d rotation;
  rotation.col(2) = up;
  const Eigen::Vector3d first = axes.col((nearest + 1) % 3);
  rotation.col(0) = (first - up * up.dot(first)).normalized();
  rotation.col(1) = rotation.col(2).cross(rotation.col(0));
  upright.rotation = Eigen::Quaterniond(rotation).normalized();
  return upright;
}

EllipsoidFit FitEllipsoid(std::span<const BoxView> views, const Ellipsoid& start,
                          const EllipsoidFitOptions& options) {
  EllipsoidFit fit;
  const bool upright = options.up && options.residual == EllipsoidResidual::kEdges;
  fit.ellipsoid = upright ? MakeUpright(start, *options.up) : start;
  if (views.empty()) return fit;
  BoxProblem problem{views, options, upright ? 7 : kShapeParameters,
                     MedianDistance(views, start.center)};
  MinimizeLevenbergMarquardt(problem,
                             {.max_iterations = options.max_iterations,
                              .tolerance = 1e-4,  // far below the noise of the boxes
                              .damping = 1e-3,
                              .raise = 8,
                              .lower = 6,
                              .least = 1e-7},
                             fit.ellipsoid);
  problem.Linearize(fit.ellipsoid);
  fit.cost = problem.equations.cost;
  fit.success = problem.equations.in_front > 0 && fit.ellipsoid.center.allFinite() &&
                fit.ellipsoid.half_axes.allFinite() && fit.ellipsoid.rotation.coeffs().allFinite();
  return fit;
}

EllipsoidFit FitFromSphere(std::span<const BoxView> views, const Ellipsoid& sphere,
                           const EllipsoidFitOptions& options) {
  const EllipsoidFit fit = FitEllipsoid(views, sphere, options);
  if (!options.up || options.residual != EllipsoidResidual::kEdges) return fit;
  Ellipsoid turned = sphere;
  turned.rotation = Eigen::AngleAxisd(std::numbers::pi / 4, *options.up) * sphere.rotation;
  const EllipsoidFit other = FitEllipsoid(views, turned, options);
  return !fit.success || (other.success && other.cost < fit.cost) ? other : fit;
}

ShapeCovariance EstimateCovariance(const Ellipsoid& ellipsoid, std::span<const BoxView> views) {
  // The errors of boxes are 4 detector pixels (1 sigma), and about 6 neighbouring views of a video
  // of 30 Hz have the same error. With these values, boxes from other sides are as far off as
  // predicted. The noise of 10 is that of kPriorWeightPx.
  constexpr double kEdgeVariance = 16, kCorrelatedViews = 6, kNoisePx = 10;
  ShapeCovariance information = ShapeCovariance::Zero();
  for (const BoxView& view : views) {
    const auto seen = ViewEllipsoid(ellipsoid, view.cam_from_world);
    if (!seen) continue;
    const Eigen::Vector4d residual =
        EdgeResidual(OutlineBox(seen->outline, *view.camera), view.box, view.truncated);
    const double unit = DetectorPixel(*view.camera);
    if (view.score * residual.squaredNorm() > 4 * kHuberPx * kHuberPx * unit * unit)
      continue;  // 20 detector pixels off: a box of another object, or a wrong one
    const EdgesByShape jacobian = DifferentiateByShape(*seen, *view.camera);
    for (int row = 0; row < 4; ++row) {
      if (view.truncated & (1 << row)) continue;
      const Eigen::Matrix<double, 7, 1> j = jacobian.row(row).head<7>().transpose();
      information.noalias() +=
          view.weight * j * j.transpose() / (kCorrelatedViews * kEdgeVariance * unit * unit);
    }
  }
  for (const BoxView& view : views)
    if (const auto surface = SurfaceResidualOf(view, ellipsoid)) {
      const Eigen::Matrix<double, 7, 1> j = surface->by_shape.head<7>();
      information.noalias() += view.weight * view.surface_weight * j * j.transpose() /
                               (kCorrelatedViews * kEdgeVariance);
    }
  const Eigen::Matrix<double, 4, 3> prior = ShapePriorRows(kPriorWeightPx / kNoisePx, true);
  information.block<3, 3>(3, 3) += prior.transpose() * prior;
  // A weak prior for what no view observes: the centre to about the object's size, the rotation to
  // about a third of a turn.
  const double size = std::cbrt(ellipsoid.half_axes.prod());
  information.diagonal().head<3>().array() += 1 / (4 * size * size);
  information.diagonal().segment<3>(3).array() += 1;
  information(6, 6) += 1;
  return InverseOf<7>(information);
}

}  // namespace oaslam
