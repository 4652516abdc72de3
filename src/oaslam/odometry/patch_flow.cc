#include "oaslam/odometry/patch_flow.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace oaslam {
namespace {

constexpr int kSide = 16;        // of a patch
constexpr int kRim = kSide + 2;  // with a pixel on each side, for its derivatives
constexpr int kWeightBits = 14;  // of bilinear weights
constexpr int kGreyBits = 5;     // fractional bits of an interpolated pixel: fits 16 bits
constexpr double kOne = 1 << kGreyBits;

// Noise of one grey level moves a patch by a pixel over the root of this sum of squared
// derivatives: it must stay below half a pixel.
constexpr double kLeastTexture = 4;

using Patch = std::array<int16_t, kSide * kSide>;

// A square of `side` pixels whose first is at (x, y), bilinear.
template <int side>
void Sample(const GreyImage& image, float x, float y, int16_t* out) {
  const float fx = std::floor(x), fy = std::floor(y);
  const int column = static_cast<int>(fx), row = static_cast<int>(fy);
  constexpr float unit = 1 << kWeightBits;
  const int w11 = static_cast<int>((x - fx) * (y - fy) * unit + 0.5F);
  const int w01 = static_cast<int>((x - fx) * unit + 0.5F) - w11;
  const int w10 = static_cast<int>((y - fy) * unit + 0.5F) - w11;
  const int w00 = (1 << kWeightBits) - w01 - w10 - w11;
  constexpr int shift = kWeightBits - kGreyBits, half = 1 << (shift - 1);
  for (int r = 0; r < side; ++r) {
    const uint8_t* a = image.data + (row + r) * image.step + column;
    const uint8_t* b = a + image.step;
    for (int c = 0; c < side; ++c)
      out[r * side + c] = static_cast<int16_t>(
          (a[c] * w00 + a[c + 1] * w01 + b[c] * w10 + b[c + 1] * w11 + half) >> shift);
  }
}

// The largest distance from the edge of an image at which a square may begin that is centred on a
// point of the image: within the border of the pyramid.
static_assert(kRim / 2 + 1 < GreyPyramid::kBorder);

bool IsIn(const GreyImage& image, const Eigen::Vector2f& px) {
  return px.x() >= 0 && px.y() >= 0 && px.x() <= static_cast<float>(image.width - 1) &&
         px.y() <= static_cast<float>(image.height - 1);
}

// A patch of the first image with its derivatives, less their means: so a constant difference of
// brightness drops out of the normal equations.
struct Template {
  Patch grey, dx, dy;
  double mean_dx = 0, mean_dy = 0;
  Eigen::Matrix2d inverse_hessian;

  // False where the patch has too little texture.
  bool Set(const GreyImage& image, const Eigen::Vector2f& px) {
    std::array<int16_t, kRim * kRim> wide;
    Sample<kRim>(image, px.x() - 0.5F * (kRim - 1), px.y() - 0.5F * (kRim - 1), wide.data());
    int64_t sum_x = 0, sum_y = 0, xx = 0, xy = 0, yy = 0;
    for (int r = 0; r < kSide; ++r) {
      int32_t row_x = 0, row_y = 0, row_xx = 0, row_xy = 0, row_yy = 0;
      for (int c = 0; c < kSide; ++c) {
        const int16_t* p = wide.data() + r * kRim + c;
        const int16_t *q = p + kRim, *s = q + kRim;
        // Scharr's derivatives: twice the slope.
        const int gx = (3 * (p[2] - p[0] + s[2] - s[0]) + 10 * (q[2] - q[0])) >> 4;
        const int gy = (3 * (s[0] - p[0] + s[2] - p[2]) + 10 * (s[1] - p[1])) >> 4;
        const int i = r * kSide + c;
        grey[i] = q[1];
        dx[i] = static_cast<int16_t>(gx);
        dy[i] = static_cast<int16_t>(gy);
        row_x += gx;
        row_y += gy;
        row_xx += gx * gx;
        row_xy += gx * gy;
        row_yy += gy * gy;
      }
      sum_x += row_x;
      sum_y += row_y;
      xx += row_xx;
      xy += row_xy;
      yy += row_yy;
    }
    constexpr double n = kSide * kSide;
    mean_dx = static_cast<double>(sum_x) / n;
    mean_dy = static_cast<double>(sum_y) / n;
    Eigen::Matrix2d hessian;
    hessian(0, 0) = static_cast<double>(xx) - n * mean_dx * mean_dx;
    hessian(1, 1) = static_cast<double>(yy) - n * mean_dy * mean_dy;
    hessian(0, 1) = hessian(1, 0) = static_cast<double>(xy) - n * mean_dx * mean_dy;
    const double trace = hessian.trace(), determinant = hessian.determinant();
    const double least = 0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4 * determinant)));
    if (least < kLeastTexture * 4 * kOne * kOne) return false;
    inverse_hessian << hessian(1, 1), -hessian(0, 1), -hessian(0, 1), hessian(0, 0);
    inverse_hessian /= determinant;
    return true;
  }

  // The step of Gauss and Newton for a patch around the present place.
  Eigen::Vector2d StepOf(const Patch& there) const {
    int64_t sum = 0, by_x = 0, by_y = 0;
    for (int r = 0; r < kSide; ++r) {
      int32_t row = 0, row_x = 0, row_y = 0;
      for (int c = 0; c < kSide; ++c) {
        const int i = r * kSide + c;
        const int difference = there[i] - grey[i];
        row += difference;
        row_x += difference * dx[i];
        row_y += difference * dy[i];
      }
      sum += row;
      by_x += row_x;
      by_y += row_y;
    }
    const Eigen::Vector2d gradient(static_cast<double>(by_x) - mean_dx * static_cast<double>(sum),
                                   static_cast<double>(by_y) - mean_dy * static_cast<double>(sum));
    return -2 * (inverse_hessian * gradient);
  }
};

}  // namespace

std::optional<Eigen::Vector2f> FollowPatch(const GreyPyramid& first, const GreyPyramid& second,
                                           const Eigen::Vector2f& px, const Eigen::Vector2f& guess,
                                           const FlowOptions& options) {
  const int levels = std::min({options.levels, first.levels(), second.levels()});
  Template from;
  Patch there;
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
      Sample<kSide>(b, to.x() - 0.5F * (kSide - 1), to.y() - 0.5F * (kSide - 1), there.data());
      const Eigen::Vector2d step = from.StepOf(there);
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
