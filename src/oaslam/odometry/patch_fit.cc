#include "oaslam/odometry/patch_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>

#include "oaslam/odometry/grey_pyramid.h"

namespace oaslam {
namespace {

constexpr int kHalf = 5, kSide = 2 * kHalf, kPixels = kSide * kSide;

using Values = std::array<float, kPixels>;
using Six = Eigen::Matrix<double, 6, 1>;

// The offset of a row or column from the middle of the patch.
constexpr float OffsetOf(int i) { return static_cast<float>(i - kHalf) + 0.5F; }

// A pixel weighs by its place alone: 1 in the middle, 0 beyond the corners.
constexpr Values MakeWeights() {
  Values weights{};
  for (int r = 0; r < kSide; ++r)
    for (int c = 0; c < kSide; ++c) {
      const float square = OffsetOf(r) * OffsetOf(r) + OffsetOf(c) * OffsetOf(c);
      const float share = 1 - square / (2.2F * kHalf * kHalf);
      weights[r * kSide + c] = share * share;
    }
  return weights;
}
constexpr Values kWeights = MakeWeights();

constexpr float SumOf(const Values& values) {
  float sum = 0;
  for (const float v : values) sum += v;
  return sum;
}
constexpr float kWeight = SumOf(kWeights);

// The grey value between four pixels.
float GreyAt(const GreyImage& image, float x, float y) {
  const float left = std::floor(x), top = std::floor(y);
  const uint8_t* p = image.Row(static_cast<int>(top)) + static_cast<int>(left);
  const float right = x - left, down = y - top;
  const float above = static_cast<float>(p[0]) + right * static_cast<float>(p[1] - p[0]);
  p += image.step;
  const float below = static_cast<float>(p[0]) + right * static_cast<float>(p[1] - p[0]);
  return above + down * (below - above);
}

// Whether all within `reach` of a place may be read.
bool CanRead(const GreyImage& image, const Eigen::Vector2f& px, const Eigen::Vector2f& reach) {
  constexpr float kBeyond = GreyPyramid::kBorder - 2;
  return px.x() - reach.x() > -kBeyond && px.y() - reach.y() > -kBeyond &&
         px.x() + reach.x() < static_cast<float>(image.width - 1) + kBeyond &&
         px.y() + reach.y() < static_cast<float>(image.height - 1) + kBeyond;
}

// Less the weighted mean.
void Centre(Values& values) {
  float sum = 0;
  for (int i = 0; i < kPixels; ++i) sum += kWeights[i] * values[i];
  for (float& v : values) v -= sum / kWeight;
}

float Product(const Values& a, const Values& b) {
  float sum = 0;
  for (int i = 0; i < kPixels; ++i) sum += kWeights[i] * a[i] * b[i];
  return sum;
}

// The patch of the first image, with its derivatives by the six parameters: the place, px, and the
// stretch, row by row, in halves of the patch.
struct FirstPatch {
  Values grey;
  std::array<Values, 6> by;
  Eigen::Matrix<double, 6, 6> information;

  FirstPatch(const GreyImage& image, const Eigen::Vector2f& px) {
    constexpr int kRim = kSide + 2;
    std::array<float, kRim * kRim> wide;
    for (int r = 0; r < kRim; ++r)
      for (int c = 0; c < kRim; ++c)
        wide[r * kRim + c] = GreyAt(image, px.x() + OffsetOf(c - 1), px.y() + OffsetOf(r - 1));
    for (int r = 0; r < kSide; ++r)
      for (int c = 0; c < kSide; ++c) {
        const float* at = &wide[(r + 1) * kRim + c + 1];
        const int i = r * kSide + c;
        const float dx = 0.5F * (at[1] - at[-1]), dy = 0.5F * (at[kRim] - at[-kRim]);
        const float x = OffsetOf(c) / kHalf, y = OffsetOf(r) / kHalf;
        grey[i] = at[0];
        by[0][i] = dx;
        by[1][i] = dy;
        by[2][i] = dx * x;
        by[3][i] = dx * y;
        by[4][i] = dy * x;
        by[5][i] = dy * y;
      }
    Centre(grey);
    for (Values& values : by) Centre(values);
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
  constexpr double kHeld = (kNoise / (kStretch * kHalf)) * (kNoise / (kStretch * kHalf));
  constexpr float kLeastContrast = 0.1F * kWeight;  // squared grey levels: noise
  constexpr int kMaxIterations = 10;
  constexpr float kSettledPx = 0.02F;
  if (!CanRead(first, px, Eigen::Vector2f::Constant(kHalf + 1))) return std::nullopt;
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
    const Eigen::Vector2f reach = pose.stretch.cwiseAbs() * Eigen::Vector2f::Constant(kHalf);
    if (!CanRead(second, pose.px, reach)) return std::nullopt;
    Values seen;
    for (int r = 0; r < kSide; ++r)
      for (int c = 0; c < kSide; ++c) {
        const Eigen::Vector2f at =
            pose.px + pose.stretch * Eigen::Vector2f(OffsetOf(c), OffsetOf(r));
        seen[r * kSide + c] = GreyAt(second, at.x(), at.y());
      }
    Centre(seen);
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
      gradient(2 + k) += kHeld * kHalf * static_cast<double>(change(k / 2, k % 2));
    const Eigen::Matrix<float, 6, 1> step = solver.solve(gradient).cast<float>();
    const Eigen::Matrix2f stretch{{1 + step(2) / kHalf, step(3) / kHalf},
                                  {step(4) / kHalf, 1 + step(5) / kHalf}};
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
