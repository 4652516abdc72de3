#include "oaslam/estimation/two_view_models.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <array>
#include <cmath>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/decompositions.h"

namespace oaslam {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Rows8x9 = Eigen::Matrix<double, 8, 9>;

Eigen::Matrix3d FromRowMajor(const Vector9d& v) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
}

Eigen::Matrix<double, 1, 9> EssentialRow(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  Eigen::Matrix<double, 1, 9> row;
  row << y.x() * x.transpose(), y.y() * x.transpose(), y.z() * x.transpose();
  return row;
}

// The two independent rows of [y]x H x = 0.
Eigen::Matrix<double, 2, 9> HomographyRows(const Eigen::Vector3d& x, const Eigen::Vector3d& y) {
  Eigen::Matrix<double, 2, 9> rows;
  rows << -x.transpose(), Eigen::RowVector3d::Zero(), y.x() * x.transpose(),  //
      Eigen::RowVector3d::Zero(), -x.transpose(), y.y() * x.transpose();
  return rows;
}

// The null vector of eight equations: the last vector of an orthogonal basis that
// begins with their rows.
Vector9d NullVector(const Rows8x9& rows) {
  const Eigen::HouseholderQR<Eigen::Matrix<double, 9, 8>> qr(rows.transpose());
  Vector9d last = Vector9d::Unit(8);
  last.applyOnTheLeft(qr.householderQ());
  return last;
}

Vector9d LeastSquaresNullVector(const Matrix9d& normal) {
  return Eigen::SelfAdjointEigenSolver<Matrix9d>(normal).eigenvectors().col(0);
}

Eigen::Matrix3d NearestEssential(const Eigen::Matrix3d& m) {
  const SingularValues svd = SingularValuesOf(m);
  return svd.u * Eigen::Vector3d(1, 1, 0).asDiagonal() * svd.v.transpose();
}

double ClippedScore(double chi2, double bound) { return chi2 < bound ? kChi2TwoDof - chi2 : 0; }

double EssentialScore(const RayMatches& m, const Eigen::Matrix3d& e, int i, double inverse_sigma2) {
  const Eigen::Vector3d in_second = e * m.first[i], in_first = e.transpose() * m.second[i];
  const double algebraic = m.second[i].dot(in_second),
               squared = algebraic * algebraic * inverse_sigma2;
  return ClippedScore(squared * m.focal_second * m.focal_second / in_second.head<2>().squaredNorm(),
                      kChi2OneDof) +
         ClippedScore(squared * m.focal_first * m.focal_first / in_first.head<2>().squaredNorm(),
                      kChi2OneDof);
}

double TransferScore(const Eigen::Matrix3d& h, const Eigen::Vector3d& x, const Eigen::Vector3d& y,
                     double weight) {
  const Eigen::Vector3d moved = h * x;
  return ClippedScore((moved.head<2>() / moved.z() - y.head<2>()).squaredNorm() * weight,
                      kChi2TwoDof);
}

template <int kCount>
std::array<int, kCount> Sample(int n, Rng& rng) {
  std::array<int, kCount> sample{};
  for (int i = 0; i < kCount;) {
    sample[i] = rng.Index(n);
    bool fresh = true;
    for (int j = 0; j < i; ++j) fresh &= sample[j] != sample[i];
    i += fresh;
  }
  return sample;
}

// RANSAC with a local optimisation of the best model on its inliers. make_score(model)(i): what
// match i adds to the score; rows(i): its equations.
template <int kSample, typename SampleRows, typename Repair, typename Score, typename Rows>
TwoViewModel Ransac(const RayMatches& matches, int iterations, Rng& rng, SampleRows&& sample_rows,
                    Repair&& repair, Score&& make_score, Rows&& rows) {
  const auto score = [&](const Eigen::Matrix3d& model) {
    const auto score_of = make_score(model);
    double sum = 0;
    for (int i = 0; i < matches.size(); ++i) sum += score_of(i);
    return sum;
  };
  TwoViewModel best;
  if (matches.size() < kSample) return best;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const Eigen::Matrix3d model =
        repair(FromRowMajor(NullVector(sample_rows(Sample<kSample>(matches.size(), rng)))));
    if (const double s = score(model); s > best.score) best = {model, s};
  }
  // It ends before the fourth time where the score does not rise.
  for (int polish = 0; polish < 4 && best.score > 0; ++polish) {
    const auto score_of = make_score(best.matrix);
    Matrix9d normal = Matrix9d::Zero();
    for (int i = 0; i < matches.size(); ++i)
      if (score_of(i) > 0) normal += rows(i).transpose() * rows(i);
    const Eigen::Matrix3d model = repair(FromRowMajor(LeastSquaresNullVector(normal)));
    const double s = score(model);
    if (!(s > best.score)) break;
    best = {model, s};
  }
  return best;
}

}  // namespace

TwoViewModel FitHomography(const RayMatches& matches, int iterations, Rng& rng) {
  const auto make_score = [&](const Eigen::Matrix3d& h) {
    const Eigen::Matrix3d inverse = h.inverse();
    return [&matches, h, inverse](int i) {
      return TransferScore(h, matches.first[i], matches.second[i],
                           std::pow(matches.focal_second / matches.sigma[i], 2)) +
             TransferScore(inverse, matches.second[i], matches.first[i],
                           std::pow(matches.focal_first / matches.sigma[i], 2));
    };
  };
  const auto rows = [&](int i) { return HomographyRows(matches.first[i], matches.second[i]); };
  const auto sample_rows = [&](const std::array<int, 4>& sample) {
    Rows8x9 all;
    for (int k = 0; k < 4; ++k) all.middleRows<2>(2 * k) = rows(sample[k]);
    return all;
  };
  return Ransac<4>(
      matches, iterations, rng, sample_rows, [](const Eigen::Matrix3d& h) { return h; }, make_score,
      rows);
}

TwoViewModel FitEssential(const RayMatches& matches, int iterations, Rng& rng) {
  const auto make_score = [&](const Eigen::Matrix3d& e) {
    return [&matches, e](int i) {
      return EssentialScore(matches, e, i, 1 / (matches.sigma[i] * matches.sigma[i]));
    };
  };
  const auto rows = [&](int i) { return EssentialRow(matches.first[i], matches.second[i]); };
  const auto sample_rows = [&](const std::array<int, 8>& sample) {
    Rows8x9 all;
    for (int k = 0; k < 8; ++k) all.row(k) = rows(sample[k]);
    return all;
  };
  return Ransac<8>(matches, iterations, rng, sample_rows, NearestEssential, make_score, rows);
}

std::vector<Rigid3> MotionsOfEssential(
    const Eigen::Matrix3d& essential) {  // Hartley & Zisserman, result 9.19
  const SingularValues svd = SingularValuesOf(essential);
  Eigen::Matrix3d w;
  w << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Vector3d t = svd.u.col(2);
  std::vector<Rigid3> motions;
  for (const Eigen::Matrix3d& middle : {w, Eigen::Matrix3d(w.transpose())}) {
    Eigen::Matrix3d r = svd.u * middle * svd.v.transpose();
    if (r.determinant() < 0) r = -r;
    motions.emplace_back(r, t);
    motions.emplace_back(r, -t);
  }
  return motions;
}

// Ma, Soatto, Kosecka, Sastry, "An Invitation to 3-D Vision", algorithm 5.2.
std::vector<Rigid3> MotionsOfHomography(const Eigen::Matrix3d& homography,
                                        const RayMatches& matches) {
  Eigen::Matrix3d h = homography / SingularValuesOf(homography).values(1);
  int positive = 0;
  for (int i = 0; i < matches.size(); ++i)
    positive += matches.second[i].dot(h * matches.first[i]) > 0;
  if (2 * positive < matches.size()) h = -h;

  const SymmetricEigen<3> eigen = EigenOfSymmetric(Eigen::Matrix3d(h.transpose() * h));
  const double s1 = eigen.values(2), s3 = eigen.values(0);
  if (!(s1 - s3 > 1e-4)) return {};
  const Eigen::Vector3d v1 = eigen.vectors.col(2), v2 = eigen.vectors.col(1),
                        v3 = eigen.vectors.col(0);
  const double a = std::sqrt(std::max(0.0, 1 - s3) / (s1 - s3)),
               b = std::sqrt(std::max(0.0, s1 - 1) / (s1 - s3));
  std::vector<Rigid3> motions;
  for (const Eigen::Vector3d& u :
       {Eigen::Vector3d(a * v1 + b * v3), Eigen::Vector3d(a * v1 - b * v3)}) {
    Eigen::Matrix3d before, after;
    before << v2, u, v2.cross(u);
    after << h * v2, h * u, (h * v2).cross(h * u);
    const Eigen::Matrix3d r = after * before.transpose();
    const Eigen::Vector3d t = (h - r) * v2.cross(u);
    if (!(t.norm() > 1e-6)) continue;
    motions.emplace_back(Eigen::Quaterniond(r).normalized(), t.normalized());
    motions.emplace_back(Eigen::Quaterniond(r).normalized(), -t.normalized());
  }
  return motions;
}

}  // namespace oaslam
