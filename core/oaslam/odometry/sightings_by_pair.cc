#include "oaslam/odometry/sightings_by_pair.h"

#include <Eigen/Geometry>

namespace oaslam {

void SightingsByPair::Set(const InverseDepthProblem& problem, size_t poses, bool with_outliers) {
  problem_ = &problem;
  FindPairs(poses);
  std::vector<size_t> next;
  for (const ImagePair& pair : pairs_) next.push_back(pair.begin);
  table_.Resize(pairs_.empty() ? 0 : pairs_.back().end);
  row_of_.clear();
  for (size_t i = 0; i < problem.measurements.size(); ++i) {
    const DepthMeasurement& m = problem.measurements[i];
    const size_t row = next[pair_of_[i]]++;
    row_of_.push_back(row);
    const Eigen::Vector2d& ray = problem.points[m.point].ray;
    table_.anchor_x[row] = ray.x();
    table_.anchor_y[row] = ray.y();
    table_.seen_x[row] = m.ray.x();
    table_.seen_y[row] = m.ray.y();
    if (m.is_outlier && !with_outliers) continue;
    table_.root_xx[row] = m.root_information(0, 0);
    table_.root_xy[row] = m.root_information(0, 1);
    table_.root_yy[row] = m.root_information(1, 1);
  }
}

// In the order in which the measurements name them; each with room for its own.
void SightingsByPair::FindPairs(size_t poses) {
  pairs_.clear();
  images_.clear();
  pair_of_.clear();
  std::vector<int> index(poses * poses, -1);
  for (const DepthMeasurement& m : problem_->measurements) {
    const int anchor = problem_->points[m.point].anchor;
    int& i = index[m.pose * poses + anchor];
    if (i < 0) {
      i = static_cast<int>(pairs_.size());
      pairs_.emplace_back();
      images_.push_back({m.pose, anchor});
    }
    pair_of_.push_back(i);
    ++pairs_[i].end;
  }
  size_t rows = 0;
  for (ImagePair& pair : pairs_) {
    pair.begin = rows;
    rows += WholeVectors(pair.end);
    pair.end = rows;
  }
}

void SightingsByPair::Update(const InverseDepthState& state) {
  std::vector<Eigen::Matrix3d> rotations;
  for (const Rigid3& pose : state.poses) rotations.push_back(pose.rotation.toRotationMatrix());
  for (size_t i = 0; i < pairs_.size(); ++i) {
    const auto [pose, anchor] = images_[i];
    Eigen::Map<Eigen::Matrix3d> rotation(pairs_[i].rotation.data());
    rotation = rotations[pose] * rotations[anchor].transpose();
    Eigen::Map<Eigen::Vector3d>(pairs_[i].translation.data()) =
        state.poses[pose].translation - rotation * state.poses[anchor].translation;
  }
  for (size_t i = 0; i < row_of_.size(); ++i)
    table_.inverse_depth[row_of_[i]] = state.inverse_depths[problem_->measurements[i].point];
}

}  // namespace oaslam
