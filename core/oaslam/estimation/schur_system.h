#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <vector>

#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/pose_step.h"

namespace oaslam {

// The normal equations of poses (6 parameters each) and landmarks (D each) whose residuals depend
// on one landmark at most. The landmarks are eliminated by their Schur complement, which leaves a
// dense system of the poses (Triggs et al., "Bundle Adjustment - A Modern Synthesis", 2000): meant
// for some dozens of poses.
template <int D>
class SchurSystem {
 public:
  using LandmarkMatrix = Eigen::Matrix<double, D, D>;
  using LandmarkVector = Eigen::Matrix<double, D, 1>;
  using CrossBlock = Eigen::Matrix<double, 6, D>;

  explicit SchurSystem(int poses)
      : hessian_(Eigen::MatrixXd::Zero(6 * poses, 6 * poses)),
        gradient_(Eigen::VectorXd::Zero(6 * poses)) {}

  void Clear() {
    hessian_.setZero();
    gradient_.setZero();
    landmarks_.clear();
    cross_.clear();
  }

  // Blocks of J^T J and J^T r; of the first only the lower half is used: row >= column.
  auto Hessian(int row, int column) { return hessian_.block<6, 6>(6 * row, 6 * column); }
  auto Gradient(int pose) { return gradient_.segment<6>(6 * pose); }

  // The parts of a landmark that depend on poses are added before the landmark itself; a pose may
  // come more than once.
  void AddCross(int pose, const CrossBlock& block) { cross_.push_back({pose, block}); }
  void AddLandmark(const LandmarkMatrix& hessian, const LandmarkVector& gradient) {
    landmarks_.push_back({hessian, LandmarkMatrix::Zero(), gradient, cross_.size()});
  }

  // Solves the equations with their diagonal multiplied by 1 + damping. Calls
  // `move_landmark(landmark, step)` for each landmark, then `move_pose(pose, step)` for each pose.
  // Returns false, and calls neither, where the equations cannot be solved.
  template <typename MovePose, typename MoveLandmark>
  bool Step(double damping, MovePose&& move_pose, MoveLandmark&& move_landmark) {
    Eigen::MatrixXd system = hessian_;
    Eigen::VectorXd right = -gradient_;
    const int poses = static_cast<int>(gradient_.size()) / 6;
    for (int k = 0; k < poses; ++k) {
      auto diagonal = system.diagonal().template segment<6>(6 * k);
      const double largest = diagonal.maxCoeff();
      diagonal *= 1 + damping;
      diagonal.array() += kRidge * (1 + largest);
    }
    Eliminate(damping, system, right);
    const auto solution = SolvePositive(system, right);
    if (!solution || !solution->allFinite()) return false;
    const Eigen::VectorXd& step = *solution;
    size_t first = 0;
    for (size_t i = 0; i < landmarks_.size(); ++i) {
      const Landmark& l = landmarks_[i];
      LandmarkVector back = -l.gradient;
      for (size_t c = first; c < l.cross_end; ++c)
        back.noalias() -= cross_[c].block.transpose() * step.segment<6>(6 * cross_[c].pose);
      move_landmark(i, LandmarkVector(l.inverse * back));
      first = l.cross_end;
    }
    for (int k = 0; k < poses; ++k) move_pose(k, PoseVector(step.segment<6>(6 * k)));
    return true;
  }

 private:
  // Added to the diagonal for a pose or landmark without observations. It is a share of the largest
  // element, since the unit of length is arbitrary, and far below what observations determine.
  static constexpr double kRidge = 1e-12;

  struct Cross {
    int pose;
    CrossBlock block;
  };
  struct Landmark {
    LandmarkMatrix hessian, inverse;
    LandmarkVector gradient;
    size_t cross_end;  // one past its cross blocks
  };

  // Fills the lower half of the system.
  void Eliminate(double damping, Eigen::MatrixXd& system, Eigen::VectorXd& right) {
    size_t first = 0;
    for (Landmark& l : landmarks_) {
      LandmarkMatrix hessian = l.hessian;
      hessian.diagonal() *= 1 + damping;
      hessian.diagonal().array() += kRidge * (1 + hessian.diagonal().maxCoeff());
      l.inverse = hessian.inverse();
      for (size_t i = first; i < l.cross_end; ++i) {
        const int row = cross_[i].pose;
        const CrossBlock scaled = cross_[i].block * l.inverse;
        right.segment<6>(6 * row).noalias() += scaled * l.gradient;
        for (size_t j = first; j < l.cross_end; ++j)
          if (cross_[j].pose <= row)
            system.block<6, 6>(6 * row, 6 * cross_[j].pose).noalias() -=
                scaled * cross_[j].block.transpose();
      }
      first = l.cross_end;
    }
  }

  Eigen::MatrixXd hessian_;
  Eigen::VectorXd gradient_;
  std::vector<Landmark> landmarks_;
  std::vector<Cross> cross_;
};

}  // namespace oaslam
