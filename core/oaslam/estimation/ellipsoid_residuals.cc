#include "oaslam/estimation/ellipsoid_residuals.h"

#include <Eigen/LU>
#include <cmath>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// Keeps unobserved axes from vanishing; the paper has no such prior. A sixth of that of the edges:
// it should not show in what the boxes determine.
constexpr double kWassersteinPriorWeightPx = 5;
// The cost of a view that has the object behind it is that of a box that is wrong by this many
// detector pixels: half the image, more than any box of an object in view.
constexpr double kBehindPx = 300;

struct Loss {
  double cost, weight;
};

Loss HuberLoss(double squared) {
  if (squared <= kHuberPx * kHuberPx) return {squared, 1};
  const double norm = std::sqrt(squared);
  return {2 * kHuberPx * norm - kHuberPx * kHuberPx, kHuberPx / norm};
}

Loss LossOf(EllipsoidResidual residual, double squared) {
  return residual == EllipsoidResidual::kEdges ? HuberLoss(squared) : Loss{squared, 1};
}

Eigen::Matrix<double, 4, 3> PriorRows(const EllipsoidFitOptions& options) {
  return options.residual == EllipsoidResidual::kEdges
             ? ShapePriorRows(kPriorWeightPx, options.up.has_value())
             : ShapePriorRows(kWassersteinPriorWeightPx, false);
}

// Scales a squared residual in px to detector pixels and weights it by the detector's score.
double ScaleOf(const BoxView& view) {
  const double unit = DetectorPixel(*view.camera);
  return view.score / (unit * unit);
}

void Accumulate(const BoxView& view, const EllipsoidView& seen, EllipsoidResidual kind,
                EllipsoidEquations& normal) {
  const auto add = [&](const auto& residual, const auto& jacobian, auto&& mask) {
    const double scale = ScaleOf(view);
    const Loss loss = LossOf(kind, scale * residual.squaredNorm());
    const double weight = view.weight * loss.weight * scale;
    normal.cost += view.weight * loss.cost;
    for (int row = 0; row < residual.size(); ++row) {
      if (!mask(row)) continue;
      const ShapeVector j = jacobian.row(row).transpose();
      normal.hessian.noalias() += weight * j * j.transpose();
      normal.gradient.noalias() += weight * residual[row] * j;
    }
  };
  if (kind == EllipsoidResidual::kEdges) {
    const Eigen::Vector4d residual =
        EdgeResidual(OutlineBox(seen.outline, *view.camera), view.box, view.truncated);
    add(residual, DifferentiateByShape(seen, *view.camera),
        [&](int row) { return !(view.truncated & (1 << row)) || residual[row] != 0; });
  } else {
    const WassersteinResidual w =
        ComputeWasserstein(InscribedEllipse(view.box), OutlineEllipse(seen.outline, *view.camera));
    const Eigen::Matrix<double, 6, kShapeParameters> jacobian =
        w.by_moments * DifferentiateEllipse(seen, *view.camera);
    add(w.value, jacobian, [](int) { return true; });
  }
}

std::optional<SurfaceResidual> SurfaceOf(const BoxView& view, const Ellipsoid& ellipsoid,
                                         const EllipsoidFitOptions& options) {
  if (options.residual != EllipsoidResidual::kEdges) return std::nullopt;
  return SurfaceResidualOf(view, ellipsoid);
}

}  // namespace

Eigen::Vector4d EdgeResidual(const Box& predicted, const Box& detected, unsigned char truncated) {
  Eigen::Vector4d residual = Edges(predicted) - Edges(detected);
  if (truncated == 0) return residual;
  if (truncated & kLeft) residual[0] = std::max(residual[0], 0.0);
  if (truncated & kTop) residual[1] = std::max(residual[1], 0.0);
  if (truncated & kRight) residual[2] = std::min(residual[2], 0.0);
  if (truncated & kBottom) residual[3] = std::min(residual[3], 0.0);
  return residual;
}

WassersteinResidual ComputeWasserstein(const Ellipse& detected, const Ellipse& projected) {
  // The inscribed ellipse is axis-aligned: S1^1/2 = diag(s).
  const Eigen::Vector2d s = detected.covariance.diagonal().cwiseSqrt();
  const Eigen::Matrix2d m = s.asDiagonal() * projected.covariance * s.asDiagonal();
  const double root = std::sqrt(std::max(m.determinant(), 1e-12)),
               norm = std::sqrt(m.trace() + 2 * root);
  const Eigen::Matrix2d numerator = m + root * Eigen::Matrix2d::Identity();
  const Eigen::Vector2d inverse = s.cwiseInverse();

  WassersteinResidual result;
  result.value.head<2>() = projected.mean - detected.mean;
  const Eigen::Matrix2d shape =
      inverse.asDiagonal() * (numerator / norm) - Eigen::Matrix2d(s.asDiagonal());
  result.value.tail<4>() = shape.reshaped();
  result.by_moments.setZero();
  result.by_moments.topLeftCorner<2, 2>().setIdentity();
  for (int k = 0; k < 3; ++k) {
    Eigen::Matrix2d dm = Eigen::Matrix2d::Zero();
    if (k == 0) dm(0, 0) = s[0] * s[0];
    if (k == 1) dm(0, 1) = dm(1, 0) = s[0] * s[1];
    if (k == 2) dm(1, 1) = s[1] * s[1];
    const double d_det = dm(0, 0) * m(1, 1) + m(0, 0) * dm(1, 1) - 2 * m(0, 1) * dm(0, 1);
    const double d_root = 0.5 * d_det / root, d_norm = (dm.trace() + 2 * d_root) / (2 * norm);
    const Eigen::Matrix2d change =
        inverse.asDiagonal() *
        ((dm + d_root * Eigen::Matrix2d::Identity()) / norm - numerator * (d_norm / (norm * norm)));
    result.by_moments.block<4, 1>(2, 2 + k) = change.reshaped();
  }
  return result;
}

Eigen::Matrix<double, 4, 3> ShapePriorRows(double weight_px, bool horizontal_pair) {
  Eigen::Matrix<double, 4, 3> rows = Eigen::Matrix<double, 4, 3>::Constant(-1.0 / 3);
  rows.topRows<3>() += Eigen::Matrix3d::Identity();
  rows.row(3) << 1, -1, 0;
  if (!horizontal_pair) rows.row(3).setZero();
  return weight_px * rows;
}

SurfaceDepth SurfaceDepthOf(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world) {
  SurfaceDepth surface;
  surface.along = cam_from_world.rotation.toRotationMatrix().row(2);
  const Eigen::Vector3d on_axes = ellipsoid.rotation.conjugate() * surface.along;
  surface.squares = (on_axes.cwiseProduct(ellipsoid.half_axes)).cwiseAbs2();
  surface.half_axis = std::sqrt(surface.squares.sum());
  surface.z = (cam_from_world * ellipsoid.center).z() - kFrontOfCenter * surface.half_axis;
  return surface;
}

double SigmaOfSurface(double half_axis, double measured) {
  constexpr double kOfAxis = 0.35, kOfDepth = 0.02;
  return kOfAxis * half_axis + kOfDepth * measured;
}

std::optional<SurfaceResidual> SurfaceResidualOf(const BoxView& view, const Ellipsoid& ellipsoid) {
  constexpr double kEdgePx = 4;  // detector pixels: the sigma of a box's edge
  if (!(view.surface > 0) || view.truncated) return std::nullopt;
  const SurfaceDepth surface = SurfaceDepthOf(ellipsoid, view.cam_from_world);
  const double scale = kEdgePx / SigmaOfSurface(surface.half_axis, view.surface);
  SurfaceResidual residual;
  residual.value = scale * (surface.z - view.surface);
  // By a rotation it changes little.
  residual.by_shape.head<3>() = scale * surface.along;
  residual.by_shape.segment<3>(3) = -scale * kFrontOfCenter / surface.half_axis * surface.squares;
  return residual;
}

EllipsoidEquations Linearize(std::span<const BoxView> views, const Ellipsoid& ellipsoid,
                             const EllipsoidFitOptions& options) {
  EllipsoidEquations normal;
  for (const BoxView& view : views) {
    if (const auto seen = ViewEllipsoid(ellipsoid, view.cam_from_world)) {
      Accumulate(view, *seen, options.residual, normal);
      if (const auto surface = SurfaceOf(view, ellipsoid, options)) {
        const Loss loss = HuberLoss(surface->value * surface->value);
        const double of_view = view.weight * view.surface_weight, weight = of_view * loss.weight;
        normal.cost += of_view * loss.cost;
        normal.hessian.noalias() += weight * surface->by_shape * surface->by_shape.transpose();
        normal.gradient.noalias() += weight * surface->value * surface->by_shape;
      }
      ++normal.in_front;
    } else {
      normal.cost += view.weight * LossOf(options.residual, kBehindPx * kBehindPx).cost;
    }
  }
  const Eigen::Matrix<double, 4, 3> rows = PriorRows(options);
  const Eigen::Vector4d prior = rows * ellipsoid.half_axes.array().log().matrix();
  normal.cost += prior.squaredNorm();
  normal.gradient.segment<3>(3) += rows.transpose() * prior;
  normal.hessian.block<3, 3>(3, 3) += rows.transpose() * rows;
  return normal;
}

double EvaluateCost(std::span<const BoxView> views, const Ellipsoid& ellipsoid,
                    const EllipsoidFitOptions& options) {
  double cost = (PriorRows(options) * ellipsoid.half_axes.array().log().matrix()).squaredNorm();
  for (const BoxView& view : views) {
    const auto seen = ViewEllipsoid(ellipsoid, view.cam_from_world);
    double squared = kBehindPx * kBehindPx;
    if (seen && options.residual == EllipsoidResidual::kEdges)
      squared = ScaleOf(view) *
                EdgeResidual(OutlineBox(seen->outline, *view.camera), view.box, view.truncated)
                    .squaredNorm();
    else if (seen)
      squared = ScaleOf(view) * SquaredWasserstein(InscribedEllipse(view.box),
                                                   OutlineEllipse(seen->outline, *view.camera));
    cost += view.weight * LossOf(options.residual, squared).cost;
    if (const auto surface = seen ? SurfaceOf(view, ellipsoid, options) : std::nullopt)
      cost += view.weight * view.surface_weight * HuberLoss(surface->value * surface->value).cost;
  }
  return cost;
}

}  // namespace oaslam
