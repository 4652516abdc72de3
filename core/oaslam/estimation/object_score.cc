#include "oaslam/estimation/object_score.h"

#include <algorithm>

#include "oaslam/estimation/ellipsoid_residuals.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"

namespace oaslam {
namespace {

// The error of a box's edge: 2 detector pixels (DetectorPixel) and 6 % of its size, so that edges
// of large objects, which have no sharp outline, weigh less.
constexpr double kPixelNoise = 2, kSizeNoise = 0.06;
// A deviation beyond six sigma counts as six: one wrong edge must not outweigh the three others.
constexpr double kMaxDeviation = 6;
// Detector pixels over which the sizes of boxes are spread where nothing is known of the object.
constexpr double kTypicalSize = 250;
// Detector pixels, about half the image, beyond which the linear model of the variance is
// meaningless.
constexpr double kMaxEdgeSigma = 300;

}  // namespace

ObjectScore::ObjectScore(const Camera& camera)
    : pixel_unit_(DetectorPixel(camera)),
      log_background_(std::log(static_cast<double>(camera.width) * camera.height) +
                      2 * std::log(kTypicalSize * pixel_unit_)) {}

double ObjectScore::DetectorSigma(const Box& detected) const {
  return kPixelNoise * pixel_unit_ + kSizeNoise * SizeOf(detected);
}

double ObjectScore::operator()(const Box& detected, unsigned char truncated, const Box& predicted,
                               const Eigen::Vector4d& edge_variance) const {
  const double sigma = DetectorSigma(detected);
  const Eigen::Array4d s = (edge_variance.array() + sigma * sigma).sqrt();
  const Eigen::Array4d r = EdgeResidual(predicted, detected, truncated).array().abs();
  return std::max(log_background_ - std::log(16 * s.prod()) - (r / s).min(kMaxDeviation).sum(),
                  0.0);
}

double ObjectScore::WithCommonVariance(const Box& detected, unsigned char truncated,
                                       const Box& predicted, double edge_variance) const {
  const double sigma = DetectorSigma(detected), variance = sigma * sigma + edge_variance;
  const Eigen::Array4d r = EdgeResidual(predicted, detected, truncated).array().abs();
  return std::max(log_background_ - std::log(16 * variance * variance) -
                      (r / std::sqrt(variance)).min(kMaxDeviation).sum(),
                  0.0);
}

Eigen::Vector4d EdgeVariance(const EllipsoidView& view, const Camera& camera,
                             const ShapeCovariance& covariance) {
  const Eigen::Matrix<double, 4, 7> jacobian = DifferentiateByShape(view, camera).leftCols<7>();
  const Eigen::Vector4d variance = (jacobian * covariance).cwiseProduct(jacobian).rowwise().sum();
  const double max_sigma_px = kMaxEdgeSigma * DetectorPixel(camera);
  return variance.cwiseMax(0.0).cwiseMin(max_sigma_px * max_sigma_px);
}

}  // namespace oaslam
