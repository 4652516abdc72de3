#include "oaslam/odometry/inverse_depth_kernels.h"

#include <cmath>
#include <cstdint>
#include <cstring>

#include "oaslam/estimation/huber.h"
#include "oaslam/odometry/inverse_depth_problem.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE \
  "oaslam/odometry/inverse_depth_kernels.cc"  // compiled once for each instruction set
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace oaslam {
namespace HWY_NAMESPACE {

// Highway has no vectors of doubles for WebAssembly. The compiler's own are made of those that the
// instruction set has.
using Four = double __attribute__((vector_size(32)));
using Mask = int64_t __attribute__((vector_size(32)));

HWY_INLINE Four Set(double x) { return Four{x, x, x, x}; }
HWY_INLINE Four Load(const double* from) {
  Four x;
  std::memcpy(&x, from, sizeof x);
  return x;
}
HWY_INLINE void Store(Four x, double* to) { std::memcpy(to, &x, sizeof x); }
HWY_INLINE Four Root(Four x) {
  return Four{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
}
template <int kLane>
HWY_INLINE Four Broadcast(Four x) {
  return __builtin_shufflevector(x, x, kLane, kLane, kLane, kLane);
}

HWY_INLINE void Transpose(Four& a, Four& b, Four& c, Four& d) {
  const Four ab_even = __builtin_shufflevector(a, b, 0, 4, 2, 6),
             ab_odd = __builtin_shufflevector(a, b, 1, 5, 3, 7),
             cd_even = __builtin_shufflevector(c, d, 0, 4, 2, 6),
             cd_odd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  a = __builtin_shufflevector(ab_even, cd_even, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_odd, cd_odd, 0, 1, 4, 5);
  c = __builtin_shufflevector(ab_even, cd_even, 2, 3, 6, 7);
  d = __builtin_shufflevector(ab_odd, cd_odd, 2, 3, 6, 7);
}

// The pseudo-Huber loss and its weight.
HWY_INLINE Four LossCost(Four chi2, double corner_chi2) {
  if (corner_chi2 <= 0) return chi2;
  return Set(2 * corner_chi2) * (Root(Set(1) + chi2 * Set(1 / corner_chi2)) - Set(1));
}
HWY_INLINE Four LossWeight(Four chi2, double corner_chi2) {
  if (corner_chi2 <= 0) return Set(1);
  return Set(1) / Root(Set(1) + chi2 * Set(1 / corner_chi2));
}

// A point in the frame of the image, times its inverse depth.
struct Points {
  Four x, y, z;
};

struct Pose {
  explicit HWY_INLINE Pose(const ImagePair& pair) {
    for (int i = 0; i < 9; ++i) r[i] = Set(pair.rotation[i]);
    for (int i = 0; i < 3; ++i) t[i] = Set(pair.translation[i]);
  }
  HWY_INLINE Points At(Four x, Four y, Four inverse_depth) const {
    return {r[0] * x + r[3] * y + r[6] + inverse_depth * t[0],
            r[1] * x + r[4] * y + r[7] + inverse_depth * t[1],
            r[2] * x + r[5] * y + r[8] + inverse_depth * t[2]};
  }
  Four r[9], t[3];
};

// The root of the information of a sighting, symmetric.
struct Root2 {
  Four xx, xy, yy;
};

HWY_INLINE Four Chi2(const Points& p, Four seen_x, Four seen_y, const Root2& root) {
  const Mask is_behind = p.z < Set(kNearest);
  const Four z = is_behind ? Set(1) : p.z;
  const Four off_x = p.x / z - seen_x, off_y = p.y / z - seen_y;
  const Four x = root.xx * off_x + root.xy * off_y, y = root.xy * off_x + root.yy * off_y;
  return is_behind ? Set(kBehindChi2) : x * x + y * y;
}

void Costs(std::span<const ImagePair> pairs, const SightingTable& t, double corner_chi2,
           double* costs) {
  for (const ImagePair& pair : pairs) {
    const Pose pose(pair);
    for (size_t i = pair.begin; i < pair.end; i += 4) {
      const Points p =
          pose.At(Load(&t.anchor_x[i]), Load(&t.anchor_y[i]), Load(&t.inverse_depth[i]));
      const Four chi2 = Chi2(p, Load(&t.seen_x[i]), Load(&t.seen_y[i]),
                             {Load(&t.root_xx[i]), Load(&t.root_xy[i]), Load(&t.root_yy[i])});
      Store(LossCost(chi2, corner_chi2), costs + i);
    }
  }
}

void CostsOfDepths(const ImagePair& pair, const SightingTable& t, size_t row,
                   std::span<const double> inverse_depths, double corner_chi2, double* costs) {
  const Pose pose(pair);
  const Four x = Set(t.anchor_x[row]), y = Set(t.anchor_y[row]), seen_x = Set(t.seen_x[row]),
             seen_y = Set(t.seen_y[row]);
  const Root2 root{Set(t.root_xx[row]), Set(t.root_xy[row]), Set(t.root_yy[row])};
  for (size_t i = 0; i < inverse_depths.size(); i += 4) {
    const Points p = pose.At(x, y, Load(&inverse_depths[i]));
    const Four chi2 = Chi2(p, seen_x, seen_y, root);
    Store(Load(costs + i) + LossCost(chi2, corner_chi2), costs + i);
  }
}

// A step of the anchor moves points as the opposite step of the image does, in the frame of the
// image: by the adjoint of the relative pose (Barfoot 2017, 7.1.4). From a derivative by the step
// of the image, that by the step of the anchor.
HWY_INLINE void ByAnchor(const Pose& pose, const Four by_image[6], Four by_anchor[6]) {
  const Four *r = pose.r, *t = pose.t, *v = by_image, *w = by_image + 3;
  const Four turned[3] = {t[1] * v[2] - t[2] * v[1] - w[0], t[2] * v[0] - t[0] * v[2] - w[1],
                          t[0] * v[1] - t[1] * v[0] - w[2]};
  for (int i = 0; i < 3; ++i) {
    by_anchor[i] = -(r[3 * i] * v[0] + r[3 * i + 1] * v[1] + r[3 * i + 2] * v[2]);
    by_anchor[3 + i] = r[3 * i] * turned[0] + r[3 * i + 1] * turned[1] + r[3 * i + 2] * turned[2];
  }
}

// The derivatives of a residual by the pose, by rows, with the residual: j0 to j5, r, 0.
struct DerivativeRow {
  Four first, second;
};

// Adds up J^T W J and J^T W r of one sighting after the other.
class PairSum {
 public:
  HWY_INLINE PairSum() {
    for (Four& s : first_) s = Set(0);
    for (Four& s : second_) s = Set(0);
  }
  HWY_INLINE void Add(Four weight, const DerivativeRow& x, const DerivativeRow& y) {
    const DerivativeRow a{weight * x.first, weight * x.second},
        b{weight * y.first, weight * y.second};
    AddRow<0>(Broadcast<0>(a.first), Broadcast<0>(b.first), x, y);
    AddRow<1>(Broadcast<1>(a.first), Broadcast<1>(b.first), x, y);
    AddRow<2>(Broadcast<2>(a.first), Broadcast<2>(b.first), x, y);
    AddRow<3>(Broadcast<3>(a.first), Broadcast<3>(b.first), x, y);
    AddRow<4>(Broadcast<0>(a.second), Broadcast<0>(b.second), x, y);
    AddRow<5>(Broadcast<1>(a.second), Broadcast<1>(b.second), x, y);
  }
  HWY_INLINE void Store(PairTerms& out) const {
    for (int row = 0; row < 6; ++row) {
      for (int column = 0; column < 6; ++column)
        out.hessian[6 * column + row] = column < 4 ? first_[row][column] : second_[row][column - 4];
      out.gradient[row] = second_[row][2];
    }
  }

 private:
  template <int kRow>
  HWY_INLINE void AddRow(Four a, Four b, const DerivativeRow& x, const DerivativeRow& y) {
    first_[kRow] += a * x.first + b * y.first;
    second_[kRow] += a * x.second + b * y.second;
  }

  Four first_[6], second_[6];
};

void Linearize(std::span<const ImagePair> pairs, const SightingTable& t, double corner_chi2,
               SightingTerms* terms, PairTerms* sums) {
  for (const ImagePair& pair : pairs) {
    const Pose pose(pair);
    PairSum sum;
    for (size_t i = pair.begin; i < pair.end; i += 4) {
      const Four rho = Load(&t.inverse_depth[i]);
      const Root2 root{Load(&t.root_xx[i]), Load(&t.root_xy[i]), Load(&t.root_yy[i])};
      const Points p = pose.At(Load(&t.anchor_x[i]), Load(&t.anchor_y[i]), rho);
      const Mask is_behind = p.z < Set(kNearest);
      const Four inverse_z = Set(1) / (is_behind ? Set(1) : p.z);
      const Four projected_x = p.x * inverse_z, projected_y = p.y * inverse_z;
      const Four off_x = projected_x - Load(&t.seen_x[i]), off_y = projected_y - Load(&t.seen_y[i]);
      const Four residual_x = root.xx * off_x + root.xy * off_y,
                 residual_y = root.xy * off_x + root.yy * off_y;
      const Four chi2 = residual_x * residual_x + residual_y * residual_y;
      const Four weight = is_behind ? Set(0) : LossWeight(chi2, corner_chi2);
      // Of the residuals by the point.
      const Four xx = root.xx * inverse_z, xy = root.xy * inverse_z, yy = root.yy * inverse_z;
      const Four x_by_z = -(xx * projected_x + xy * projected_y),
                 y_by_z = -(xy * projected_x + yy * projected_y);
      const Four x_by_rho = xx * pose.t[0] + xy * pose.t[1] + x_by_z * pose.t[2],
                 y_by_rho = xy * pose.t[0] + yy * pose.t[1] + y_by_z * pose.t[2];
      Four x[8] = {rho * xx,
                   rho * xy,
                   rho * x_by_z,
                   x_by_z * p.y - xy * p.z,
                   xx * p.z - x_by_z * p.x,
                   xy * p.x - xx * p.y,
                   residual_x,
                   Set(0)};
      Four y[8] = {rho * xy,
                   rho * yy,
                   rho * y_by_z,
                   y_by_z * p.y - yy * p.z,
                   xy * p.z - y_by_z * p.x,
                   yy * p.x - xy * p.y,
                   residual_y,
                   Set(0)};
      Four term[16];
      term[0] = weight * (x_by_rho * x_by_rho + y_by_rho * y_by_rho);
      term[1] = weight * (x_by_rho * residual_x + y_by_rho * residual_y);
      for (int k = 0; k < 6; ++k) term[2 + k] = weight * x[k] * x_by_rho + weight * y[k] * y_by_rho;
      ByAnchor(pose, term + 2, term + 8);
      term[14] = term[15] = Set(0);
      for (int k = 0; k < 16; k += 4) {
        Transpose(term[k], term[k + 1], term[k + 2], term[k + 3]);
        for (int lane = 0; lane < 4; ++lane)
          Store(term[k + lane], reinterpret_cast<double*>(terms + i + lane) + k);
      }
      for (Four* row : {x, y})
        for (int k = 0; k < 8; k += 4) Transpose(row[k], row[k + 1], row[k + 2], row[k + 3]);
      sum.Add(Broadcast<0>(weight), {x[0], x[4]}, {y[0], y[4]});
      sum.Add(Broadcast<1>(weight), {x[1], x[5]}, {y[1], y[5]});
      sum.Add(Broadcast<2>(weight), {x[2], x[6]}, {y[2], y[6]});
      sum.Add(Broadcast<3>(weight), {x[3], x[7]}, {y[3], y[7]});
    }
    sum.Store(*sums++);
  }
}

void Eliminate(std::span<const DepthCross> cross, double inverse, PoseBlocks& system) {
  for (const DepthCross& a : cross) {
    double s[6];
    for (int k = 0; k < 6; ++k) s[k] = a.block[k] * inverse;
    // Two columns of a block are three vectors.
    const Four rows[3] = {
        {s[0], s[1], s[2], s[3]}, {s[4], s[5], s[0], s[1]}, {s[2], s[3], s[4], s[5]}};
    for (const DepthCross& b : cross) {
      if (b.pose > a.pose) continue;
      double* block = system.At(a.pose, b.pose);
      for (int column = 0; column < 6; column += 2, block += 12) {
        const double c = b.block[column], d = b.block[column + 1];
        Store(Load(block) - rows[0] * Set(c), block);
        Store(Load(block + 4) - rows[1] * Four{c, c, d, d}, block + 4);
        Store(Load(block + 8) - rows[2] * Set(d), block + 8);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace oaslam
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

namespace oaslam {

HWY_EXPORT(Costs);
HWY_EXPORT(CostsOfDepths);
HWY_EXPORT(Linearize);
HWY_EXPORT(Eliminate);

void SightingTable::Resize(size_t rows) {
  for (std::vector<double>* column :
       {&anchor_x, &anchor_y, &seen_x, &seen_y, &root_xx, &root_xy, &root_yy, &inverse_depth})
    column->assign(rows, 0);
}

void CostsOfSightings(std::span<const ImagePair> pairs, const SightingTable& table,
                      double corner_chi2, double* costs) {
  HWY_DYNAMIC_DISPATCH(Costs)(pairs, table, corner_chi2, costs);
}

void LinearizeSightings(std::span<const ImagePair> pairs, const SightingTable& table,
                        double corner_chi2, SightingTerms* terms, PairTerms* sums) {
  HWY_DYNAMIC_DISPATCH(Linearize)(pairs, table, corner_chi2, terms, sums);
}

void EliminateDepth(std::span<const DepthCross> cross, double inverse, PoseBlocks& system) {
  HWY_DYNAMIC_DISPATCH(Eliminate)(cross, inverse, system);
}

void AddCostsOfDepths(const ImagePair& pair, const SightingTable& table, size_t row,
                      std::span<const double> inverse_depths, double corner_chi2, double* costs) {
  HWY_DYNAMIC_DISPATCH(CostsOfDepths)(pair, table, row, inverse_depths, corner_chi2, costs);
}

}  // namespace oaslam

#endif  // HWY_ONCE
