#include "oaslam/bundle/pose_graph.h"

#include <ceres/autodiff_cost_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <ceres/solver.h>

#include <array>
#include <cmath>

#include "oaslam/util/log.h"

namespace oaslam {
namespace {

// Quaternion x y z w, translation, logarithm of the scale.
using Block = std::array<double, 8>;

Block ToBlock(const Similarity& s) {
  return {s.rotation.x(),    s.rotation.y(),    s.rotation.z(),    s.rotation.w(),
          s.translation.x(), s.translation.y(), s.translation.z(), std::log(s.scale)};
}

Similarity FromBlock(const Block& b) {
  return {
      std::exp(b[7]), Eigen::Quaterniond(b[3], b[0], b[1], b[2]).normalized(), {b[4], b[5], b[6]}};
}

// The residual motion: measured * from * to^-1, which should be the identity.
struct EdgeResidual {
  Similarity measured;
  double held, depth;
  bool is_scale_known;

  template <typename T>
  bool operator()(const T* from, const T* to, T* residual) const {
    using Quaternion = Eigen::Quaternion<T>;
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Eigen::Map<const Quaternion> from_rotation(from), to_rotation(to);
    const Eigen::Map<const Vector> from_translation(from + 4), to_translation(to + 4);
    using std::exp;
    const T measured_scale(measured.scale);
    const T scale = measured_scale * exp(from[7] - to[7]);
    const Quaternion rotation =
        measured.rotation.cast<T>() * from_rotation * to_rotation.conjugate();
    const Vector here = measured_scale * (measured.rotation.cast<T>() * from_translation) +
                        measured.translation.cast<T>();
    Eigen::Map<Eigen::Matrix<T, 7, 1>> r(residual);
    r.template head<3>() = (here - scale * (rotation * to_translation)) * T(held / depth);
    r.template segment<3>(3) = (rotation.w() < T(0) ? T(-2) : T(2)) * rotation.vec();
    r(6) = T(is_scale_known ? held : 0.0) * (std::log(measured.scale) + from[7] - to[7]);
    return true;
  }
};

}  // namespace

std::optional<std::vector<Similarity>> OptimizePoseGraph(const std::vector<Similarity>& nodes,
                                                         const std::vector<PoseGraphEdge>& edges,
                                                         const std::vector<char>& fixed) {
  std::vector<Block> blocks;
  for (const Similarity& node : nodes) blocks.push_back(ToBlock(node));
  ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<4>> manifold;
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  for (size_t i = 0; i < blocks.size(); ++i) {
    problem.AddParameterBlock(blocks[i].data(), 8, &manifold);
    if (fixed[i]) problem.SetParameterBlockConstant(blocks[i].data());
  }
  for (const PoseGraphEdge& edge : edges)
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<EdgeResidual, 7, 8, 8>(new EdgeResidual{
            edge.to_from_from, edge.held, edge.depth > 0 ? edge.depth : 1, edge.is_scale_known}),
        nullptr, blocks[edge.from].data(), blocks[edge.to].data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // CHOLMOD would start threads of OpenMP.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.max_num_iterations = 200;  // bounds the time where it does not converge
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    Log(LogLevel::kWarning, "pose graph: " + summary.message);
    return std::nullopt;
  }
  std::vector<Similarity> moved;
  for (const Block& block : blocks) moved.push_back(FromBlock(block));
  return moved;
}

}  // namespace oaslam
