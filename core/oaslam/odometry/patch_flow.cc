#include "oaslam/odometry/patch_flow.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "oaslam/odometry/patch_kernels.h"

namespace oaslam {
namespace {

constexpr double kOne = 1 << kPatchGreyBits;

// Noise of one grey level moves a patch by a pixel over the root of this sum of squared
// derivatives: it must stay below half a pixel.
constexpr double kLeastTexture = 4;

// Where a square of `side` pixels around a place begins.
PatchPlace FirstOfSquare(const GreyImage& image, const Eigen::Vector2f& px, int side) {
  const float x = px.x() - 0.5F * static_cast<float>(side - 1),
              y = px.y() - 0.5F * static_cast<float>(side - 1);
  const float fx = std::floor(x), fy = std::floor(y);
  return {image.Row(static_cast<int>(fy)) + static_cast<int>(fx), image.step,
          static_cast<int16_t>((x - fx) * 32768), static_cast<int16_t>((y - fy) * 32768)};
}

// The largest distance from the edge of an image at which a square may begin that is centred on a
// point of the image: within the border of the pyramid.
static_assert(kPatchRim / 2 + 1 < GreyPyramid::kBorder);

// A patch of the first image with its derivatives, less their means: so a constant difference of
// brightness drops out of the normal equations.
struct Template {
  DerivedPatch patch;
  double mean_dx = 0, mean_dy = 0;
  Eigen::Matrix2d inverse_hessian;

  // False where the patch has too little texture.
  bool Set(const GreyImage& image, const Eigen::Vector2f& px) {
    DerivePatch(FirstOfSquare(image, px, kPatchRim), patch);
    constexpr double n = kPatchSide * kPatchSide;
    mean_dx = static_cast<double>(patch.sum_x) / n;
    mean_dy = static_cast<double>(patch.sum_y) / n;
    Eigen::Matrix2d hessian;
    hessian(0, 0) = static_cast<double>(patch.xx) - n * mean_dx * mean_dx;
    hessian(1, 1) = static_cast<double>(patch.yy) - n * mean_dy * mean_dy;
    hessian(0, 1) = hessian(1, 0) = static_cast<double>(patch.xy) - n * mean_dx * mean_dy;
    const double trace = hessian.trace(), determinant = hessian.determinant();
    const double least = 0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4 * determinant)));
    if (least < kLeastTexture * 4 * kOne * kOne) return false;
    inverse_hessian << hessian(1, 1), -hessian(0, 1), -hessian(0, 1), hessian(0, 0);
    inverse_hessian /= determinant;
    return true;
  }

  // The step of Gauss and Newton from the place `px` of another image.
  Eigen::Vector2d StepFrom(const GreyImage& image, const Eigen::Vector2f& px) const {
    const PatchDifference d = ComparePatch(patch, FirstOfSquare(image, px, kPatchSide));
    const Eigen::Vector2d gradient(
        static_cast<double>(d.by_x) - mean_dx * static_cast<double>(d.sum),
        static_cast<double>(d.by_y) - mean_dy * static_cast<double>(d.sum));
    return -2 * (inverse_hessian * gradient);
  }
};

}  // namespace

std::optional<Eigen::Vector2f> FollowPatch(const GreyPyramid& first, const GreyPyramid& second,
                                           const Eigen::Vector2f& px, const Eigen::Vector2f& guess,
                                           const FlowOptions& options) {
  const int levels = std::min({options.levels, first.levels(), second.levels()});
  Template from;
  Eigen::Vector2f shift = guess - px;  // px of the lowest level
  for (int level = levels - 1; level >= 0; --level) {
    const float scale = static_cast<float>(1 << level);
    const Eigen::Vector2f at = px / scale;
    const GreyImage &a = first.level(level), &b = second.level(level);
    if (!IsIn(a, at)) return std::nullopt;
    if (!from.Set(a, at)) {
      if (level == 0) return std::nullopt;
      continue;
    }
    Eigen::Vector2f to = at + shift / scale;
    Eigen::Vector2d last = Eigen::Vector2d::Zero();
    for (int i = 0; i < options.max_iterations; ++i) {
      if (!IsIn(b, to)) return std::nullopt;
      const Eigen::Vector2d step = from.StepFrom(b, to);
      to += step.cast<float>();
      if (step.squaredNorm() < options.tolerance * options.tolerance) break;
      // Two places that lead to each other: the patch lies between them.
      if ((step + last).squaredNorm() < options.tolerance * options.tolerance) {
        to -= 0.5F * step.cast<float>();
        break;
      }
      last = step;
    }
    shift = (to - at) * scale;
  }
  const Eigen::Vector2f result = px + shift;
  if (!result.allFinite() || !IsIn(second.level(0), result)) return std::nullopt;
  return result;
}

std::optional<Eigen::Vector2f> FollowPatchBothWays(
    const GreyPyramid& first, const GreyPyramid& second, const Eigen::Vector2f& px,
    const Eigen::Vector2f& guess, const FlowOptions& options, double max_return_px) {
  const auto there = FollowPatch(first, second, px, guess, options);
  if (!there) return std::nullopt;
  FlowOptions back = options;
  back.levels = std::min(options.levels, 2);  // the way back is known
  const auto again = FollowPatch(second, first, *there, px, back);
  if (!again || (*again - px).norm() > max_return_px) return std::nullopt;
  return there;
}

}  // namespace oaslam
