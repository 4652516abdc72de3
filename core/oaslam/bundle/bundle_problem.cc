#include "oaslam/bundle/bundle_problem.h"

#include <ceres/loss_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>

#include "oaslam/bundle/box_cost.h"
#include "oaslam/bundle/motion_cost.h"
#include "oaslam/bundle/reprojection_cost.h"
#include "oaslam/bundle/schur_solver.h"
#include "oaslam/estimation/ellipsoid_fit.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/log.h"

namespace oaslam {
namespace {

class StopCallback final : public ceres::IterationCallback {
 public:
  explicit StopCallback(std::stop_token stop) : stop_(std::move(stop)) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return stop_.stop_requested() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  std::stop_token stop_;
};

// The parameters and residuals of one adjustment. It is solved by our own solver where that
// suffices (points only, few cameras), else by Ceres. Parameter blocks of a kind are contiguous and
// ordered by id: Ceres orders the blocks of an elimination group by address, so that the result
// depends on the map alone.
class BundleProblem {
 public:
  BundleProblem(const Map& map, const BundleSelection& selection)
      : map_(map), selection_(selection) {
    poses_.reserve(selection.free_keyframes.size());
    for (const KeyframeId id : selection.free_keyframes)
      poses_.push_back(ToBlock(map.keyframes.At(id).cam_from_world));
    CollectObservations();
    CollectMotions();
    is_small_ = poses_.size() <= kMaxDensePoses && selection.objects.empty();
    if (is_small_) return;
    Build();
    AddObjects();
  }

  int observation_count() const { return static_cast<int>(observations_.size()); }

  // Returns false if the solver found no usable solution; then nothing is changed.
  bool Solve(int max_iterations, const BundleEffort& effort) {
    if (is_small_) return SolveSmall(max_iterations, effort);
    ceres::Solver::Options options;
    options.linear_solver_type =
        poses_.size() <= kMaxDensePoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    options.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (auto& point : points_) options.linear_solver_ordering->AddElementToGroup(point.data(), 0);
    for (auto& pose : poses_) options.linear_solver_ordering->AddElementToGroup(pose.data(), 1);
    for (auto& shape : shapes_) options.linear_solver_ordering->AddElementToGroup(shape.data(), 2);
    options.max_num_iterations = max_iterations;
    options.num_threads = 1;
    // CHOLMOD starts threads of OpenMP; Eigen stays on this one, and is as fast.
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.function_tolerance = effort.tolerance;
    StopCallback stop(effort.stop);
    options.callbacks.push_back(&stop);
    options.logging_type = ceres::SILENT;
    ceres::Solver::Summary summary;
    ceres::Solve(options, problem_.get(), &summary);
    iterations_ += static_cast<int>(summary.iterations.size());
    if (summary.termination_type == ceres::USER_FAILURE) return false;
    if (!summary.IsSolutionUsable())
      Log(LogLevel::kWarning, "bundle adjustment: " + summary.message);
    return summary.IsSolutionUsable();
  }

  // Switches off the kernel and the present outliers for the next stage; returns
  // the share of outliers.
  double DropOutliers() {
    loss_.Reset(nullptr, ceres::TAKE_OWNERSHIP);
    is_robust_ = false;
    const std::vector<double> chi2 = Chi2OfAll();
    int outliers = 0;
    for (size_t i = 0; i < chi2.size(); ++i) {
      const bool active = !IsOutlier(chi2[i]);
      outliers += !active;
      observations_[i].is_active = active;
      if (observations_[i].free_cost) observations_[i].free_cost->set_active(active);
      if (observations_[i].fixed_cost) observations_[i].fixed_cost->set_active(active);
      if (observations_[i].depth_cost) observations_[i].depth_cost->set_active(active);
    }
    return static_cast<double>(outliers) / static_cast<double>(chi2.size());
  }

  BundleCorrection Correction() const {
    BundleCorrection correction;
    correction.success = true;
    correction.iterations = iterations_;
    for (size_t i = 0; i < poses_.size(); ++i)
      correction.poses.emplace_back(selection_.free_keyframes[i], FromBlock(poses_[i]));
    for (size_t i = 0; i < points_.size(); ++i)
      correction.points.emplace_back(point_ids_[i], points_[i]);
    for (size_t i = 0; i < shapes_.size(); ++i)
      correction.objects.emplace_back(selection_.objects[i],
                                      WithShapeChange(ellipsoids_[i], shapes_[i].data()));
    const std::vector<double> chi2 = Chi2OfAll();
    for (size_t i = 0; i < chi2.size(); ++i)
      if (IsOutlier(chi2[i]))
        correction.outliers.emplace_back(point_ids_[observations_[i].point],
                                         observations_[i].keyframe);
    return correction;
  }

 private:
  struct Seen {
    KeyframeId keyframe;
    int point = 0;  // index into points_
    int pose = -1;  // index into poses_; -1: fixed
    const Keyframe* by = nullptr;
    Eigen::Vector2d px;
    double sigma_px = 1;
    MeasuredDepth depth{};  // z 0: none
    ReprojectionCost* free_cost = nullptr;
    FixedPoseReprojectionCost* fixed_cost = nullptr;
    DepthCost* depth_cost = nullptr;
    bool is_active = true;
  };

  struct Moved {
    KeyframeId from, to;
    MotionMeasurement measured;
  };

  // The dense system has 360 rows there; it grows with the cube of the poses, of which few share
  // landmarks in a larger map.
  static constexpr size_t kMaxDensePoses = 60;

  static bool IsOutlier(double chi2) { return !(chi2 <= kChi2TwoDof); }

  int IndexOfFree(KeyframeId id) const {
    const auto& ids = selection_.free_keyframes;
    const auto place = std::ranges::lower_bound(ids, id);
    return place != ids.end() && *place == id ? static_cast<int>(place - ids.begin()) : -1;
  }

  // A unit that something else tells differs from that of the depth camera by its error.
  bool UsesDepths() const {
    return map_.unit_evidence && map_.unit_evidence->source == UnitSource::kDepth;
  }

  // Takes only landmarks that at least two of the selected keyframes observe; others could slide
  // along their rays.
  void CollectObservations() {
    for (const LandmarkId id : selection_.landmarks) {
      const Landmark& landmark = map_.landmarks.At(id);
      const size_t before = observations_.size();
      for (const Observation& o : landmark.observations) {
        const int pose = IndexOfFree(o.keyframe);
        if (pose < 0 && !std::ranges::binary_search(selection_.fixed_keyframes, o.keyframe))
          continue;
        const Keyframe& by = map_.keyframes.At(o.keyframe);
        const Keypoint& keypoint = by.features->keypoints[o.keypoint];
        observations_.push_back(
            {o.keyframe, static_cast<int>(points_.size()), pose, &by, keypoint.px.cast<double>(),
             static_cast<double>(by.features->pyramid.scale[keypoint.octave]),
             UsesDepths() && !by.depths.empty() ? by.depths[o.keypoint] : MeasuredDepth{}});
      }
      if (observations_.size() - before < 2) {
        observations_.resize(before);
        continue;
      }
      points_.push_back(landmark.position);
      point_ids_.push_back(id);
    }
  }

  // The motions from and to free keyframes; where one was retired, from or to its carrier.
  void CollectMotions() {
    std::vector<KeyframeId> ids = selection_.free_keyframes;
    // Of the keyframes that are not selected, mostly the next one alone has come from a free one.
    for (const KeyframeId id : selection_.free_keyframes)
      if (const KeyframeId next(id.value + 1); map_.keyframes.Contains(next)) ids.push_back(next);
    std::ranges::sort(ids);
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (const KeyframeId id : ids) {
      const Keyframe& keyframe = map_.keyframes.At(id);
      const auto from =
          keyframe.motion ? map_.ResolveKeyframe(keyframe.motion->from) : std::nullopt;
      if (!from || from->by == id || (IndexOfFree(id) < 0 && IndexOfFree(from->by) < 0)) continue;
      motions_.push_back({from->by,
                          id,
                          {0, 0, keyframe.motion->cam_from_cam * from->cam_from_carrier,
                           keyframe.motion->sigma_position, keyframe.motion->sigma_rotation,
                           keyframe.motion->IsMetric()}});
    }
  }

  void Build() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    problem_ = std::make_unique<ceres::Problem>(options);
    for (auto& point : points_) problem_->AddParameterBlock(point.data(), 3);
    for (auto& pose : poses_) problem_->AddParameterBlock(pose.data(), 7, &manifold_);
    for (Seen& seen : observations_) {
      const Camera& camera = map_.cameras[seen.by->camera];
      double* point = points_[seen.point].data();
      if (seen.pose >= 0) {
        seen.free_cost = &free_costs_.emplace_back(camera, seen.px, seen.sigma_px);
        problem_->AddResidualBlock(seen.free_cost, &loss_, poses_[seen.pose].data(), point);
      } else {
        seen.fixed_cost =
            &fixed_costs_.emplace_back(camera, seen.by->cam_from_world, seen.px, seen.sigma_px);
        problem_->AddResidualBlock(seen.fixed_cost, &loss_, point);
      }
      if (seen.depth.z > 0) AddDepth(seen);
    }
    for (const Moved& moved : motions_) {
      const int from = IndexOfFree(moved.from), to = IndexOfFree(moved.to);
      const auto fixed = [&](KeyframeId id, int pose) {
        return pose < 0 ? std::optional(map_.keyframes.At(id).cam_from_world) : std::nullopt;
      };
      std::vector<double*> blocks;
      for (const int pose : {from, to})
        if (pose >= 0) blocks.push_back(poses_[pose].data());
      problem_->AddResidualBlock(
          &motion_costs_.emplace_back(moved.measured, fixed(moved.from, from), fixed(moved.to, to)),
          moved.measured.is_sure ? nullptr : &motion_loss_, blocks);
    }
  }

  void AddDepth(Seen& seen) {
    std::vector<double*> blocks{points_[seen.point].data()};
    if (seen.pose >= 0) blocks.insert(blocks.begin(), poses_[seen.pose].data());
    seen.depth_cost = &depth_costs_.emplace_back(
        seen.depth, seen.pose >= 0 ? std::nullopt : std::optional(seen.by->cam_from_world));
    problem_->AddResidualBlock(seen.depth_cost, &depth_loss_, blocks);
  }

  bool SolveSmall(int max_iterations, const BundleEffort& effort) {
    CamerasAndPoints state;
    for (size_t i = 0; i < poses_.size(); ++i) {
      state.poses.push_back(FromBlock(poses_[i]));
      state.cameras.push_back(
          &map_.cameras[map_.keyframes.At(selection_.free_keyframes[i]).camera]);
    }
    for (const KeyframeId id : selection_.fixed_keyframes) {
      const Keyframe& keyframe = map_.keyframes.At(id);
      state.poses.push_back(keyframe.cam_from_world);
      state.cameras.push_back(&map_.cameras[keyframe.camera]);
    }
    const std::vector<MotionMeasurement> motions = Motions(state);
    state.points = points_;
    std::vector<PointMeasurement> measurements;
    measurements.reserve(observations_.size());
    for (const Seen& seen : observations_) {
      if (!seen.is_active) continue;
      const int fixed = static_cast<int>(
          poses_.size() + (std::ranges::lower_bound(selection_.fixed_keyframes, seen.keyframe) -
                           selection_.fixed_keyframes.begin()));
      measurements.push_back(
          {seen.pose >= 0 ? seen.pose : fixed, seen.point, seen.px, 1 / seen.sigma_px, seen.depth});
    }
    const MinimizationReport report = MinimizeReprojection(
        measurements, static_cast<int>(poses_.size()),
        {max_iterations, effort.tolerance, is_robust_ ? kChi2TwoDof : 0, effort.stop}, state,
        motions);
    iterations_ += report.iterations;
    if (!report.success) return false;
    for (size_t i = 0; i < poses_.size(); ++i) poses_[i] = ToBlock(state.poses[i]);
    points_ = std::move(state.points);
    return true;
  }

  // The motions with the indices of their poses; adds those of keyframes that are not selected.
  std::vector<MotionMeasurement> Motions(CamerasAndPoints& state) const {
    std::vector<MotionMeasurement> motions;
    for (const Moved& moved : motions_) {
      MotionMeasurement m = moved.measured;
      for (const auto& [id, index] : {std::pair{moved.from, &m.from}, {moved.to, &m.to}}) {
        *index = IndexOfFree(id);
        if (*index >= 0) continue;
        *index = static_cast<int>(state.poses.size());
        state.poses.push_back(map_.keyframes.At(id).cam_from_world);
      }
      motions.push_back(m);
    }
    return motions;
  }

  void AddObjects() {
    for (const ObjectId id : selection_.objects) {
      const Ellipsoid& ellipsoid = map_.objects.At(id).ellipsoid;
      ellipsoids_.push_back(map_.up ? MakeUpright(ellipsoid, *map_.up) : ellipsoid);
    }
    if (selection_.free_objects) shapes_.resize(ellipsoids_.size(), ShapeBlock{});
    for (size_t i = 0; i < ellipsoids_.size(); ++i) AddBoxesOf(i);
  }

  // Boxes seen by a fixed keyframe are used only where the ellipsoid is free.
  void AddBoxesOf(size_t index) {
    double* shape = selection_.free_objects ? shapes_[index].data() : nullptr;
    if (shape) {
      problem_->AddParameterBlock(shape, 7);
      problem_->AddResidualBlock(
          &shape_priors_.emplace_back(ellipsoids_[index], map_.up.has_value()), nullptr, shape);
    }
    for (const ObjectObservation& o : map_.objects.At(selection_.objects[index]).observations) {
      const auto carried = map_.ResolveKeyframe(o.reference);
      const int pose = IndexOfFree(carried->by);
      if (pose < 0 && !shape) continue;
      const BoxMeasurement measured{&map_.cameras[o.camera],
                                    o.cam_from_reference * carried->cam_from_carrier, o.box,
                                    o.score, o.truncated};
      const auto fixed_pose =
          pose < 0 ? std::optional(map_.keyframes.At(carried->by).cam_from_world) : std::nullopt;
      std::vector<double*> blocks;
      if (pose >= 0) blocks.push_back(poses_[pose].data());
      if (shape) blocks.push_back(shape);
      problem_->AddResidualBlock(
          &box_costs_.emplace_back(measured, ellipsoids_[index], shape != nullptr, fixed_pose),
          &box_loss_, blocks);
    }
  }

  // By observation; infinite behind the camera.
  std::vector<double> Chi2OfAll() const {
    std::vector<Eigen::Matrix<double, 3, 4>> free_poses;
    for (const PoseBlock& block : poses_) free_poses.push_back(FromBlock(block).Matrix());
    std::vector<double> chi2;
    chi2.reserve(observations_.size());
    for (const Seen& seen : observations_) {
      const Eigen::Vector3d& x = points_[seen.point];
      const Eigen::Vector3d p =
          seen.pose >= 0 ? free_poses[seen.pose] * x.homogeneous() : seen.by->cam_from_world * x;
      chi2.push_back(
          p.z() > 0 ? (ProjectIdeal(map_.cameras[seen.by->camera], p) - seen.px).squaredNorm() /
                          (seen.sigma_px * seen.sigma_px)
                    : std::numeric_limits<double>::infinity());
    }
    return chi2;
  }

  const Map& map_;
  const BundleSelection& selection_;
  std::vector<PoseBlock> poses_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<LandmarkId> point_ids_;
  std::vector<Seen> observations_;
  std::vector<Moved> motions_;
  std::deque<ReprojectionCost> free_costs_;
  std::deque<FixedPoseReprojectionCost> fixed_costs_;
  std::deque<DepthCost> depth_costs_;
  std::vector<Ellipsoid> ellipsoids_;  // start values of the selected objects
  std::vector<ShapeBlock> shapes_;     // their changes; empty where they are fixed
  std::deque<BoxEdgeCost> box_costs_;
  std::deque<ShapePriorCost> shape_priors_;
  std::deque<MotionCost> motion_costs_;
  ceres::HuberLoss depth_loss_{std::sqrt(kChi2OneDof)};
  ceres::HuberLoss motion_loss_{std::sqrt(kChi2SixDof)};
  PoseManifold manifold_;
  ceres::HuberLoss box_loss_{1};
  ceres::LossFunctionWrapper loss_{new ceres::HuberLoss(std::sqrt(kChi2TwoDof)),
                                   ceres::TAKE_OWNERSHIP};
  std::unique_ptr<ceres::Problem> problem_;
  bool is_small_ = false;  // solved by MinimizeReprojection
  bool is_robust_ = true;
  int iterations_ = 0;
};

}  // namespace

BundleCorrection SolveBundle(const Map& map, const BundleSelection& selection,
                             const BundleEffort& effort) {
  if (selection.free_keyframes.empty()) return {};
  BundleProblem problem(map, selection);
  if (problem.observation_count() == 0) return {};
  const int first_stage = (effort.iterations + 1) / 2;
  if (!problem.Solve(first_stage, effort)) return {};
  // For fewer outliers the second stage is not worth its time: the kernel bounds their influence,
  // and the next adjustment is without them.
  constexpr double kNegligibleOutliers = 0.01;
  if (problem.DropOutliers() > kNegligibleOutliers &&
      !problem.Solve(std::max(1, effort.iterations - first_stage), effort))
    return {};
  return problem.Correction();
}

}  // namespace oaslam
