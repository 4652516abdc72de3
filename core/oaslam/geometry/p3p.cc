#include "oaslam/geometry/p3p.h"

#include <Eigen/LU>
#include <cmath>

#include "oaslam/geometry/polynomial.h"

namespace oaslam {
namespace {

// Squared distances of the points and cosines of the rays, pairs in the order 01, 02, 12.
struct Pairs {
  Eigen::Vector3d squared, cosine;
};
constexpr int kFirst[3] = {0, 0, 1}, kSecond[3] = {1, 2, 2};

// The quadratic form depth_i^2 + depth_j^2 - 2 cos depth_i depth_j of a pair.
Eigen::Matrix3d Form(const Pairs& pairs, int pair) {
  const int i = kFirst[pair], j = kSecond[pair];
  Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
  m(i, i) = m(j, j) = 1;
  m(i, j) = m(j, i) = -pairs.cosine[pair];
  return m;
}

Eigen::Matrix3d Adjugate(const Eigen::Matrix3d& m) {
  Eigen::Matrix3d cofactors;
  cofactors.row(0) = m.row(1).cross(m.row(2));
  cofactors.row(1) = m.row(2).cross(m.row(0));
  cofactors.row(2) = m.row(0).cross(m.row(1));
  return cofactors.transpose();
}

struct Lines {
  std::array<Eigen::Vector3d, 2> normals;
  bool real = false;
};

// The two planes of a singular symmetric quadratic form (Richter-Gebert, "Perspectives on
// Projective Geometry", 11.1).
Lines SplitSingularForm(const Eigen::Matrix3d& form) {
  const Eigen::Matrix3d adjugate = Adjugate(form);
  int largest = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(adjugate(i, i)) > std::abs(adjugate(largest, largest))) largest = i;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  // A double plane has a vanishing adjugate; otherwise its diagonal is negative for real planes.
  if (-adjugate(largest, largest) > 1e-14 * form.squaredNorm()) {
    p = adjugate.col(largest) / std::sqrt(-adjugate(largest, largest));
  } else if (adjugate(largest, largest) > 1e-7 * form.squaredNorm()) {
    return {};
  }
  Eigen::Matrix3d rank_one = form;
  rank_one(0, 1) += p.z();
  rank_one(1, 0) -= p.z();
  rank_one(0, 2) -= p.y();
  rank_one(2, 0) += p.y();
  rank_one(1, 2) += p.x();
  rank_one(2, 1) -= p.x();
  Eigen::Index row = 0, column = 0;
  rank_one.cwiseAbs().maxCoeff(&row, &column);
  return {{rank_one.row(row).transpose(), rank_one.col(column)}, true};
}

// Newton's method on the three laws of cosines; the depths must fit to 1e-9 in the end.
bool PolishDepths(const Pairs& pairs, Eigen::Vector3d& depths) {
  const double scale = pairs.squared.maxCoeff();
  double error = 0;
  for (int iteration = 0; iteration < 6; ++iteration) {
    Eigen::Vector3d residual;
    Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
    for (int pair = 0; pair < 3; ++pair) {
      const int i = kFirst[pair], j = kSecond[pair];
      const double c = pairs.cosine[pair];
      residual[pair] = depths[i] * depths[i] + depths[j] * depths[j] -
                       2 * c * depths[i] * depths[j] - pairs.squared[pair];
      jacobian(pair, i) = 2 * (depths[i] - c * depths[j]);
      jacobian(pair, j) = 2 * (depths[j] - c * depths[i]);
    }
    error = residual.cwiseAbs().maxCoeff();
    if (error <= 1e-14 * scale) break;
    const double determinant = jacobian.determinant();
    if (determinant == 0) break;
    const Eigen::Vector3d step = Adjugate(jacobian) * residual / determinant;
    if (!step.allFinite() || step.norm() > depths.norm()) break;
    depths -= step;
  }
  return error < 1e-9 * scale && depths.minCoeff() > 0;
}

Eigen::Matrix3d FrameOf(const Eigen::Vector3d& along, const Eigen::Vector3d& beside) {
  Eigen::Matrix3d frame;
  frame.col(0) = along.normalized();
  frame.col(2) = along.cross(beside).normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

}  // namespace

P3PPoses SolveP3P(const std::array<Eigen::Vector3d, 3>& rays,
                  const std::array<Eigen::Vector3d, 3>& points) {
  P3PPoses result;
  Pairs pairs;
  for (int pair = 0; pair < 3; ++pair) {
    pairs.squared[pair] = (points[kFirst[pair]] - points[kSecond[pair]]).squaredNorm();
    pairs.cosine[pair] = rays[kFirst[pair]].dot(rays[kSecond[pair]]);
  }
  const Eigen::Vector3d along = points[1] - points[0], beside = points[2] - points[0];
  const double size = pairs.squared.maxCoeff();
  if (!(along.cross(beside).norm() > 1e-6 * size) || !(pairs.squared.minCoeff() > 1e-12 * size))
    return result;
  if (!(std::abs(rays[0].dot(rays[1].cross(rays[2]))) > 1e-12)) return result;

  // Two conics in the depths; a singular member of their pencil splits into two planes through the
  // origin of depth space.
  const Eigen::Vector3d a = pairs.squared / size;
  const Eigen::Matrix3d d1 = Form(pairs, 0) * a[2] - Form(pairs, 2) * a[0];
  const Eigen::Matrix3d d2 = Form(pairs, 1) * a[2] - Form(pairs, 2) * a[1];
  const double gamma = SolveCubicForOneRoot(d2.determinant(), (Adjugate(d2) * d1).trace(),
                                            (Adjugate(d1) * d2).trace(), d1.determinant());
  const Lines planes = SplitSingularForm(d1 + gamma * d2);
  if (!planes.real) return result;
  const Eigen::Matrix3d& other = std::abs(gamma) * d2.norm() < d1.norm() ? d2 : d1;

  const Eigen::Matrix3d world_frame = FrameOf(along, beside);
  for (const Eigen::Vector3d& normal : planes.normals) {
    // Depths in the plane: u + t v, with u and v spanning it; the other conic gives t.
    Eigen::Index axis = 0;
    normal.cwiseAbs().maxCoeff(&axis);
    const Eigen::Index second = (axis + 1) % 3, third = (axis + 2) % 3;
    Eigen::Vector3d u = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();
    u[second] = v[third] = 1;
    u[axis] = -normal[second] / normal[axis];
    v[axis] = -normal[third] / normal[axis];
    const RealRoots2 roots =
        SolveQuadratic(v.dot(other * v), 2 * u.dot(other * v), u.dot(other * u));
    for (int r = 0; r < roots.count && result.count < 4; ++r) {
      Eigen::Vector3d depths = u + roots.roots[r] * v;
      const double scale = depths.dot(Form(pairs, 2) * depths);
      if (!(scale > 0) || depths.minCoeff() <= 0) continue;
      depths *= std::sqrt(pairs.squared[2] / scale);
      if (!PolishDepths(pairs, depths)) continue;
      const Eigen::Vector3d first = depths[0] * rays[0];
      const Eigen::Matrix3d cam_from_world =
          FrameOf(depths[1] * rays[1] - first, depths[2] * rays[2] - first) *
          world_frame.transpose();
      result.poses[result.count++] = Rigid3(cam_from_world, first - cam_from_world * points[0]);
    }
  }
  return result;
}

}  // namespace oaslam
