#include "oaslam/estimation/similarity_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/skew.h"

namespace oaslam {
namespace {

constexpr double kMaxSigmas = 3;  // of a position that is an inlier
// Assumed for poses by points and by objects alike; the bound of an inlier is four of it.
constexpr double kRotationSigma = 1.5 * std::numbers::pi / 180;
constexpr double kMaxAngle = 6 * std::numbers::pi / 180;

Eigen::Quaterniond TurnBy(const PosePair& pair) {
  return pair.cam_from_b.rotation.conjugate() * pair.cam_from_a.rotation;
}

// In sigmas of the scale that the pair tells; 0 where it tells none.
double ScaleOff(const PosePair& pair, const Similarity& b_from_a) {
  return pair.scale ? std::log(b_from_a.scale / pair.scale->scale) / pair.scale->relative_sigma : 0;
}

bool IsInlier(const PosePair& pair, const Similarity& b_from_a) {
  const double distance =
      (b_from_a * pair.cam_from_a.OriginInSource() - pair.cam_from_b.OriginInSource()).norm();
  return distance < kMaxSigmas * pair.sigma &&
         b_from_a.rotation.angularDistance(TurnBy(pair)) < kMaxAngle &&
         std::abs(ScaleOff(pair, b_from_a)) < kMaxSigmas;
}

std::optional<Similarity> FromTwo(const PosePair& first, const PosePair& second) {
  const Eigen::Vector3d a = second.cam_from_a.OriginInSource() - first.cam_from_a.OriginInSource();
  const Eigen::Vector3d b = second.cam_from_b.OriginInSource() - first.cam_from_b.OriginInSource();
  // Two cameras that are closer together than twice the errors of their positions do not determine
  // the scale.
  if (a.norm() <= 0 || b.norm() < 2 * (first.sigma + second.sigma)) return std::nullopt;
  const Eigen::Quaterniond rotation = TurnBy(first).slerp(0.5, TurnBy(second));
  const double scale = b.norm() / a.norm();
  const Eigen::Vector3d middle_a =
      (first.cam_from_a.OriginInSource() + second.cam_from_a.OriginInSource()) / 2;
  const Eigen::Vector3d middle_b =
      (first.cam_from_b.OriginInSource() + second.cam_from_b.OriginInSource()) / 2;
  return Similarity(scale, rotation, middle_b - scale * (rotation * middle_a));
}

Similarity FromOne(const PosePair& pair, double scale) {
  const Eigen::Quaterniond rotation = TurnBy(pair);
  return {scale, rotation,
          pair.cam_from_b.OriginInSource() - scale * (rotation * pair.cam_from_a.OriginInSource())};
}

// The similarity of two poses, or with a known scale of one, that most agree with.
Similarity BestOfFew(std::span<const PosePair> pairs, const std::optional<ScalePrior>& prior) {
  constexpr size_t kMost = 40;  // poses that are combined: their 780 pairs bound the time
  const size_t stride = (pairs.size() + kMost - 1) / kMost;
  Similarity best;
  int64_t most = -1;
  const auto consider = [&](const Similarity& candidate) {
    const auto inliers =
        std::ranges::count_if(pairs, [&](const PosePair& p) { return IsInlier(p, candidate); });
    if (inliers <= most) return;
    most = inliers;
    best = candidate;
  };
  for (size_t i = 0; i < pairs.size(); i += stride) {
    if (prior) consider(FromOne(pairs[i], prior->scale));
    if (pairs[i].scale) consider(FromOne(pairs[i], pairs[i].scale->scale));
    for (size_t j = i + stride; !prior && j < pairs.size(); j += stride)
      if (const auto candidate = FromTwo(pairs[i], pairs[j])) consider(*candidate);
  }
  return best;
}

// Translation, rotation, log scale, applied after the similarity.
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

struct Step {
  Vector7 change;
  Matrix7 covariance;
};

// A step of Gauss-Newton on positions, rotations and scales with Cauchy's weights. It is taken
// about the mean position of the cameras, where scale and translation are not correlated.
std::optional<Step> SolveStep(std::span<const PosePair> pairs, const Similarity& b_from_a,
                              const Eigen::Vector3d& middle,
                              const std::optional<ScalePrior>& prior) {
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  if (prior) {
    const double weight = 1 / (prior->relative_sigma * prior->relative_sigma);
    information(6, 6) = weight;
    gradient[6] = weight * std::log(b_from_a.scale / prior->scale);
  }
  for (const PosePair& pair : pairs) {
    const Eigen::Vector3d at = b_from_a * pair.cam_from_a.OriginInSource(), arm = at - middle;
    const Eigen::Vector3d off = (at - pair.cam_from_b.OriginInSource()) / pair.sigma;
    const Eigen::AngleAxisd turn(b_from_a.rotation * TurnBy(pair).conjugate());
    const Eigen::Vector3d turned = turn.angle() * turn.axis() / kRotationSigma;
    Eigen::Matrix<double, 7, 7> jacobian = Eigen::Matrix<double, 7, 7>::Zero();
    jacobian.topLeftCorner<3, 3>().setIdentity();
    jacobian.block<3, 3>(0, 3) = -Skew(arm);
    jacobian.topRightCorner<3, 1>() = arm;
    jacobian.topRows<3>() /= pair.sigma;
    jacobian.block<3, 3>(3, 3) = Eigen::Matrix3d::Identity() / kRotationSigma;
    if (pair.scale) jacobian(6, 6) = 1 / pair.scale->relative_sigma;
    Vector7 residual;
    residual << off, turned, ScaleOff(pair, b_from_a);
    const double weight = 1 / (1 + residual.squaredNorm() / 4);
    information += weight * jacobian.transpose() * jacobian;
    gradient += weight * jacobian.transpose() * residual;
  }
  const auto solved = SolveAndInvertSemidefinite<7>(information, gradient);
  if (!solved || !solved->solution.allFinite()) return std::nullopt;
  return Step{-solved->solution, solved->inverse};
}

Similarity Apply(const Vector7& change, const Eigen::Vector3d& middle, const Similarity& b_from_a) {
  const Eigen::Vector3d w = change.segment<3>(3);
  const double angle = w.norm(), scale = std::exp(change[6]);
  const Eigen::Quaterniond turn = angle > 0
                                      ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle))
                                      : Eigen::Quaterniond::Identity();
  return Similarity(scale, turn, middle - scale * (turn * middle) + change.head<3>()) * b_from_a;
}

}  // namespace

SimilarityFit FitSimilarity(std::span<const PosePair> pairs,
                            const std::optional<ScalePrior>& prior) {
  constexpr int kIterations = 15;  // at most: it ends where a step is nothing
  SimilarityFit fit;
  const bool knows_scale =
      prior || std::ranges::any_of(pairs, [](const PosePair& p) { return p.scale.has_value(); });
  if (pairs.size() < (knows_scale ? 1 : 3)) return fit;
  fit.b_from_a = BestOfFew(pairs, prior);
  for (int i = 0; i < kIterations; ++i) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const PosePair& pair : pairs)
      middle += fit.b_from_a * pair.cam_from_a.OriginInSource() / static_cast<double>(pairs.size());
    const auto step = SolveStep(pairs, fit.b_from_a, middle, prior);
    if (!step) return fit;
    fit.b_from_a = Apply(step->change, middle, fit.b_from_a);
    fit.relative_sigma = std::sqrt(step->covariance(6, 6));
    if (step->change.norm() < 1e-9) break;
  }
  for (const PosePair& pair : pairs) fit.is_inlier.push_back(IsInlier(pair, fit.b_from_a));
  fit.inliers = static_cast<int>(std::ranges::count(fit.is_inlier, true));
  // Where all cameras of b coincide, a similarity of scale 0 would fit: it is rejected.
  const bool has_scale =
      fit.b_from_a.scale > 0 && fit.relative_sigma > 0 && std::isfinite(fit.relative_sigma);
  fit.success = has_scale && 2 * fit.inliers > static_cast<int>(pairs.size());
  return fit;
}

}  // namespace oaslam
