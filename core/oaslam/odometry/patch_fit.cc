#include "oaslam/odometry/patch_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <tuple>
#include <type_traits>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {
namespace {

constexpr int kHalfSide = 5, kSide = 2 * kHalfSide, kPixels = kSide * kSide;

using Values = std::array<float, kPixels>;
using Six = Eigen::Matrix<double, 6, 1>;

// The offset of a row or column from the middle of the patch.
constexpr float OffsetOf(int i) { return static_cast<float>(i - kHalfSide) + 0.5F; }

// Places of a patch's pixels, row by row, about its middle, with a rim.
template <int kRim>
struct Grid {
  static constexpr int kWidth = kSide + 2 * kRim;
  std::array<float, kWidth * kWidth> x{}, y{};

  constexpr Grid() {
    for (int r = 0; r < kWidth; ++r)
      for (int c = 0; c < kWidth; ++c) {
        x[r * kWidth + c] = OffsetOf(c - kRim);
        y[r * kWidth + c] = OffsetOf(r - kRim);
      }
  }
};
constexpr Grid<0> kPatch;
constexpr Grid<1> kWide;

// A pixel weighs by its place alone: 1 in the middle, 0 beyond the corners. The root of that.
constexpr Values MakeRootWeights() {
  Values roots{};
  for (int i = 0; i < kPixels; ++i)
    roots[i] = 1 - (kPatch.x[i] * kPatch.x[i] + kPatch.y[i] * kPatch.y[i]) /
                       (2.2F * kHalfSide * kHalfSide);
  return roots;
}
constexpr Values kRootWeights = MakeRootWeights();

constexpr float SumOfSquares(const Values& values) {
  float sum = 0;
  for (const float v : values) sum += v * v;
  return sum;
}
constexpr float kWeight = SumOfSquares(kRootWeights);

// Four pixels at a time, added up in one order: all processors give the same bits.
using Four = float __attribute__((vector_size(16)));
static_assert(kPixels % 4 == 0);
Four Load(const float* from) {
  Four x;
  std::memcpy(&x, from, sizeof x);
  return x;
}
float SumOf(Four x) { return (x[0] + x[1]) + (x[2] + x[3]); }

float Product(const Values& a, const Values& b) {
  Four sum{};
  for (int i = 0; i < kPixels; i += 4) sum += Load(&a[i]) * Load(&b[i]);
  return SumOf(sum);
}

// Less the weighted mean, times the roots of the weights: a product of two is weighted, then.
void CentreAndWeigh(Values& values) {
  Four sum{};
  for (int i = 0; i < kPixels; i += 4) {
    const Four root = Load(&kRootWeights[i]);
    sum += root * root * Load(&values[i]);
  }
  const float mean = SumOf(sum) / kWeight;
  for (int i = 0; i < kPixels; ++i) values[i] = kRootWeights[i] * (values[i] - mean);
}

// The grey values between pixels, all of which are in the image or on its border.
Four GreyAt(const GreyImage& image, Four x, Four y) {
  using FourInts = int32_t __attribute__((vector_size(16)));
  constexpr int kBorder = GreyPyramid::kBorder;  // rounds down where x + kBorder is above 0
  const FourInts left = __builtin_convertvector(x + kBorder, FourInts) - kBorder,
                 top = __builtin_convertvector(y + kBorder, FourInts) - kBorder;
  FourInts above{}, above_right{}, below{}, below_right{};
  for (int k = 0; k < 4; ++k) {
    const uint8_t* p = image.Row(top[k]) + left[k];
    above[k] = p[0];
    above_right[k] = p[1];
    below[k] = p[image.step];
    below_right[k] = p[image.step + 1];
  }
  const Four right = x - __builtin_convertvector(left, Four),
             down = y - __builtin_convertvector(top, Four);
  const Four upper = __builtin_convertvector(above, Four) +
                     right * __builtin_convertvector(above_right - above, Four),
             lower = __builtin_convertvector(below, Four) +
                     right * __builtin_convertvector(below_right - below, Four);
  return upper + down * (lower - upper);
}

// At the places of a grid, stretched.
template <int kRim>
void Sample(const GreyImage& image, const PatchPose& pose, const Grid<kRim>& grid,
            std::array<float, Grid<kRim>::kWidth * Grid<kRim>::kWidth>& values) {
  static_assert(std::tuple_size_v<std::remove_reference_t<decltype(values)>> % 4 == 0);
  const Eigen::Matrix2f& by = pose.stretch;
  for (size_t i = 0; i < values.size(); i += 4) {
    const Four c = Load(&grid.x[i]), r = Load(&grid.y[i]);
    const Four grey = GreyAt(image, pose.px.x() + (by(0, 0) * c + by(0, 1) * r),
                             pose.px.y() + (by(1, 0) * c + by(1, 1) * r));
    std::memcpy(&values[i], &grey, sizeof grey);
  }
}

// Whether all within `reach` of a place may be read.
bool CanRead(const GreyImage& image, const Eigen::Vector2f& px, const Eigen::Vector2f& reach) {
  constexpr float kBeyond = GreyPyramid::kBorder - 2;
  return px.x() - reach.x() > -kBeyond && px.y() - reach.y() > -kBeyond &&
         px.x() + reach.x() < static_cast<float>(image.width - 1) + kBeyond &&
         px.y() + reach.y() < static_cast<float>(image.height - 1) + kBeyond;
}

// The patch of the first image, with its derivatives by the six parameters: the place, px, and the
// stretch, row by row, in halves of the patch.
struct FirstPatch {
  Values grey;
  std::array<Values, 6> by;
  Eigen::Matrix<double, 6, 6> information;

  FirstPatch(const GreyImage& image, const Eigen::Vector2f& px) {
    constexpr int kWidth = Grid<1>::kWidth;
    std::array<float, kWidth * kWidth> wide;
    Sample(image, {px, Eigen::Matrix2f::Identity()}, kWide, wide);
    for (int r = 0; r < kSide; ++r)
      for (int c = 0; c < kSide; ++c) {
        const float* at = &wide[(r + 1) * kWidth + c + 1];
        const int i = r * kSide + c;
        const float dx = 0.5F * (at[1] - at[-1]), dy = 0.5F * (at[kWidth] - at[-kWidth]);
        const float x = kPatch.x[i] / kHalfSide, y = kPatch.y[i] / kHalfSide;
        grey[i] = at[0];
        by[0][i] = dx;
        by[1][i] = dy;
        by[2][i] = dx * x;
        by[3][i] = dx * y;
        by[4][i] = dy * x;
        by[5][i] = dy * y;
      }
    CentreAndWeigh(grey);
    for (Values& values : by) CentreAndWeigh(values);
    for (int k = 0; k < 6; ++k)
      for (int m = 0; m <= k; ++m)
        information(k, m) = information(m, k) = static_cast<double>(Product(by[k], by[m]));
  }
};

}  // namespace

std::optional<PatchFit> FitPatch(const GreyImage& first, const Eigen::Vector2f& px,
                                 const GreyImage& second, const PatchPose& start) {
  // Of the stretch, since the start; and of a grey value: together they say how much of a stretch
  // that the patch hardly shows is believed.
  constexpr double kStretch = 0.1, kNoise = 3;
  constexpr double kHeld = (kNoise / (kStretch * kHalfSide)) * (kNoise / (kStretch * kHalfSide));
  constexpr float kLeastContrast = 0.1F * kWeight;  // squared grey levels: noise
  constexpr int kMaxIterations = 10;
  constexpr float kSettledPx = 0.05F;
  if (!CanRead(first, px, Eigen::Vector2f::Constant(kHalfSide + 1))) return std::nullopt;
  FirstPatch patch(first, px);
  for (int k = 0; k < 2; ++k) patch.information(k, k) += 1e-6;
  for (int k = 2; k < 6; ++k) patch.information(k, k) += kHeld;
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> solver(patch.information);
  const float contrast = Product(patch.grey, patch.grey);
  if (contrast < kLeastContrast) return std::nullopt;
  const Eigen::Matrix2f start_from_patch = start.stretch.inverse();
  PatchFit fit{start};
  PatchPose& pose = fit.pose;
  for (int iteration = 0;; ++iteration) {
    const Eigen::Vector2f reach = pose.stretch.cwiseAbs() * Eigen::Vector2f::Constant(kHalfSide);
    if (!CanRead(second, pose.px, reach)) return std::nullopt;
    Values seen;
    Sample(second, pose, kPatch, seen);
    CentreAndWeigh(seen);
    const float alike = Product(seen, patch.grey), own = Product(seen, seen);
    if (own < kLeastContrast) return std::nullopt;
    fit.correlation = static_cast<double>(alike / std::sqrt(own * contrast));
    if (alike <= 0) return fit;
    const float gain = alike / own;
    for (int i = 0; i < kPixels; ++i) seen[i] = gain * seen[i] - patch.grey[i];
    Six gradient;
    for (int k = 0; k < 6; ++k) gradient(k) = static_cast<double>(Product(seen, patch.by[k]));
    const Eigen::Matrix2f change = start_from_patch * pose.stretch - Eigen::Matrix2f::Identity();
    for (int k = 0; k < 4; ++k)
      gradient(2 + k) += kHeld * kHalfSide * static_cast<double>(change(k / 2, k % 2));
    const Eigen::Matrix<float, 6, 1> step = solver.solve(gradient).cast<float>();
    const Eigen::Matrix2f stretch{{1 + step(2) / kHalfSide, step(3) / kHalfSide},
                                  {step(4) / kHalfSide, 1 + step(5) / kHalfSide}};
    pose.stretch *= stretch.inverse();
    pose.px -= pose.stretch * step.head<2>();
    const float area = pose.stretch.determinant();
    if (!(area > 0.2F && area < 5)) return PatchFit{start};
    if (step.cwiseAbs().maxCoeff() < kSettledPx || iteration == kMaxIterations) break;
  }
  if (!IsIn(second, pose.px)) return std::nullopt;
  return fit;
}

}  // namespace oaslam
