#include "oaslam/odometry/inverse_depth_problem.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "oaslam/estimation/huber.h"
#include "oaslam/odometry/inverse_depth_kernels.h"
#include "oaslam/odometry/prior_residuals.h"
#include "oaslam/odometry/sightings_by_pair.h"

namespace oaslam {
namespace {

constexpr double kCauchyChi2 = 9;  // of a measured depth: three sigmas

double InertialCost(const InertialProblem& problem, const InverseDepthState& state,
                    double huber_chi2) {
  double cost = problem.prior.CostOf(state.inertial) + std::pow(GravityError(state.inertial), 2);
  for (const InertialTriple& t : problem.triples)
    cost +=
        LossOf(ResidualOf(t, PosesOf(t, state), problem.lever, state.inertial).value.squaredNorm(),
               huber_chi2)
            .cost;
  return cost;
}

}  // namespace

double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2, SightingsByPair& sightings,
              std::vector<double>& costs) {
  const std::vector<CamMatrices> cams = CamsOf(state);
  sightings.Update(state);
  costs.resize(sightings.rows());
  CostsOfSightings(sightings.pairs(), sightings.table(), outlier_chi2 ? 0 : problem.corner_chi2,
                   costs.data());
  double cost = 0;
  for (size_t i = 0; i < problem.measurements.size(); ++i) {
    const double of = costs[sightings.RowOf(i)];
    if (outlier_chi2)
      cost += LossOf(std::min(of, *outlier_chi2), problem.huber_chi2).cost;
    else if (!problem.measurements[i].is_outlier)
      cost += of;
  }
  for (size_t i = 0; i < problem.points.size(); ++i) {
    const DepthPrior& p = problem.points[i];
    const double off = (state.inverse_depths[i] - p.inverse_depth) / p.sigma;
    cost += p.is_measured ? kCauchyChi2 * std::log1p(off * off / kCauchyChi2) : off * off;
  }
  for (const VelocityPrior& v : problem.velocities) cost += ChangeOfVelocity(v, cams).squaredNorm();
  for (const TurnRatePrior& t : problem.turn_rates)
    cost += LossOf(ChangeOfTurnRate(t, cams).squaredNorm(), problem.huber_chi2).cost;
  for (const RotationPrior& r : problem.rotations) cost += RotationError(r, cams).squaredNorm();
  if (problem.inertial) cost += InertialCost(*problem.inertial, state, problem.huber_chi2);
  if (problem.length) {
    const LengthPrior& l = *problem.length;
    const double off = ((cams[l.second].center - cams[l.first].center).norm() - l.length) / l.sigma;
    cost += off * off;
  }
  return cost;
}

double WeightOf(const DepthPrior& prior, double inverse_depth) {
  if (!prior.is_measured) return 1;
  const double off = (inverse_depth - prior.inverse_depth) / prior.sigma;
  return 1 / (1 + off * off / kCauchyChi2);
}

double CostOf(const InverseDepthProblem& problem, const InverseDepthState& state,
              std::optional<double> outlier_chi2) {
  SightingsByPair sightings;
  sightings.Set(problem, state.poses.size(), outlier_chi2.has_value());
  std::vector<double> costs;
  return CostOf(problem, state, outlier_chi2, sightings, costs);
}

InverseDepthProblem WithoutPriors(InverseDepthProblem problem) {
  constexpr double kUnknown = 1e6;  // sigma of an inverse depth
  problem.velocities.clear();
  problem.turn_rates.clear();
  problem.rotations.clear();
  problem.inertial.reset();
  for (DepthPrior& p : problem.points) p.sigma = kUnknown;
  return problem;
}

double CostOfImages(const InverseDepthProblem& bare, const InverseDepthState& state) {
  return CostOf(bare, state, kMostSigmas * kMostSigmas) /
         std::max<double>(1, static_cast<double>(bare.measurements.size()));
}

void SearchDepths(double usual, const InverseDepthProblem& problem, InverseDepthState& state) {
  std::array candidates{0.0, 0.1, 0.3, 0.6, 1.0, 1.6, 2.5, 4.0, 6.0, 9.0, 14.0};
  for (double& depth : candidates) depth *= usual;
  SearchDepths(candidates, problem, state);
}

void SearchDepths(std::span<const double> candidates, const InverseDepthProblem& problem,
                  InverseDepthState& state) {
  SightingsByPair sightings;
  sightings.Set(problem, state.poses.size(), true);
  sightings.Update(state);
  // Filled up by the last one, of which the first place counts.
  std::vector<double> padded(candidates.begin(), candidates.end());
  padded.resize(WholeVectors(candidates.size()), candidates.back());
  std::vector<double> costs(padded.size());
  size_t next = 0;
  for (size_t point = 0; point < problem.points.size(); ++point) {
    std::ranges::fill(costs, 0);
    for (; next < problem.measurements.size() &&
           problem.measurements[next].point == static_cast<int>(point);
         ++next)
      AddCostsOfDepths(sightings.PairOf(next), sightings.table(), sightings.RowOf(next), padded,
                       problem.corner_chi2, costs.data());
    state.inverse_depths[point] = candidates[std::ranges::min_element(costs) - costs.begin()];
  }
}

}  // namespace oaslam
