#include "oaslam/bundle/self_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "oaslam/bundle/camera_motion.h"
#include "oaslam/bundle/intrinsics_solver.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/map/camera_replacement.h"

namespace oaslam {
namespace {

// More keyframes hardly add information on one lens, and the cost of the dense system grows with
// their square.
constexpr size_t kMaxKeyframes = 120;
// With fewer of either, the five parameters would follow the noise.
constexpr int kMinKeyframes = 5, kMinPoints = 30;
// With a larger uncertainty a guess from the usual fields of view is hardly worse.
constexpr double kMaxRelativeSigma = 0.02;
// The least angle between the rays of a point that is useful, and the least share of such points.
constexpr double kMinParallaxRad = 0.5 * std::numbers::pi / 180, kMinParallaxShare = 0.1;
// Without rotation, focal length and depth cannot be distinguished.
constexpr double kMinTurnRad = 5 * std::numbers::pi / 180;
// Bounds of the focal length, relative to the longer side of the image: fields of view of 147
// and 9.5 degrees. Outside of them there is no solution, or the lens needs a calibration.
constexpr double kMinFocal = 0.15, kMaxFocal = 6;

struct Problem {
  std::vector<RollingMeasurement> measurements;  // ordered by point
  IntrinsicsState state;
  std::vector<KeyframeId> keyframes;  // by pose
  std::vector<LandmarkId> landmarks;  // by point
};

// By index into Map::cameras: the focal length divided by that of a camera, where it is the same
// lens; else nothing.
std::vector<std::optional<double>> ZoomsOf(const Map& map, int camera) {
  std::vector<std::optional<double>> zooms;
  for (const Camera& other : map.cameras)
    zooms.push_back(ZoomBetween(map.cameras[static_cast<size_t>(camera)], other));
  zooms[static_cast<size_t>(camera)] = 1;
  return zooms;
}

std::vector<KeyframeId> SelectKeyframes(const Map& map,
                                        const std::vector<std::optional<double>>& zooms) {
  std::vector<KeyframeId> all;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
    if (zooms[static_cast<size_t>(k.camera)]) all.push_back(id);
  });
  if (all.size() <= kMaxKeyframes) return all;
  std::vector<KeyframeId> spread;
  for (size_t i = 0; i < kMaxKeyframes; ++i) spread.push_back(all[i * all.size() / kMaxKeyframes]);
  return spread;
}

// The displacement of a static point in the image for each second of readout time, due to the
// distance of its row in the image from the middle one.
Eigen::Vector2d ByReadout(const Camera& camera, const Keyframe& keyframe,
                          const CameraMotion& motion, const Eigen::Vector3d& point, double row) {
  const Eigen::Vector3d p = keyframe.cam_from_world * point;
  const auto velocity = motion.At(keyframe.timestamp);
  if (!velocity || p.z() <= 0) return Eigen::Vector2d::Zero();
  return ((row + 0.5) / camera.height - 0.5) * PixelWithDerivatives(camera, p).by_point *
         velocity->Of(p);
}

Problem Collect(const Map& map, int camera, std::span<const FramePose> trajectory) {
  const CameraMotion motion(map, trajectory);
  Problem problem;
  problem.state.camera = map.cameras[static_cast<size_t>(camera)];
  const std::vector<std::optional<double>> zooms = ZoomsOf(map, camera);
  const Eigen::Vector2d centre(problem.state.camera.cx, problem.state.camera.cy);
  problem.keyframes = SelectKeyframes(map, zooms);
  for (const KeyframeId id : problem.keyframes)
    problem.state.poses.push_back(map.keyframes.At(id).cam_from_world);
  map.landmarks.ForEach([&](LandmarkId id, const Landmark& landmark) {
    const size_t before = problem.measurements.size();
    const int point = static_cast<int>(problem.landmarks.size());
    for (const Observation& o : landmark.observations) {
      const auto place = std::ranges::lower_bound(problem.keyframes, o.keyframe);
      if (place == problem.keyframes.end() || *place != o.keyframe) continue;
      const Features& features = *map.keyframes.At(o.keyframe).features;
      const Keypoint& k = features.keypoints[o.keypoint];
      const double zoom = *zooms[static_cast<size_t>(map.keyframes.At(o.keyframe).camera)];
      const Eigen::Vector2d ideal = k.px.cast<double>(),
                            unzoomed = zoom == 1 ? ideal : centre + (ideal - centre) / zoom;
      const Eigen::Vector2d raw = Distort(problem.state.camera, unzoomed);
      const double row =
          zoom == 1 ? raw.y() : Distort(Zoomed(problem.state.camera, zoom), ideal).y();
      const PointMeasurement measurement{static_cast<int>(place - problem.keyframes.begin()), point,
                                         raw, zoom / features.pyramid.scale[k.octave]};
      problem.measurements.push_back(
          {measurement, ByReadout(problem.state.camera, map.keyframes.At(o.keyframe), motion,
                                  landmark.position, row)});
    }
    if (problem.measurements.size() - before < 2) {
      problem.measurements.resize(before);
      return;
    }
    problem.landmarks.push_back(id);
    problem.state.points.push_back(landmark.position);
  });
  return problem;
}

IntrinsicsPrior PriorOf(const Camera& camera, const SelfCalibrationOptions& options) {
  // Lenses of one kind differ little: the principal point of a phone is off by about 1 % of the
  // longer side of the image, and a strongly distorting wide lens has a k1 of about -0.3.
  constexpr double kCenterSigma = 0.01, kDistortionSigma = 0.2;
  const double center = kCenterSigma * std::max(camera.width, camera.height);
  IntrinsicsPrior p{options.expected.value_or(camera), 0, {}};
  p.sigma << std::numeric_limits<double>::infinity(), center, center, kDistortionSigma,
      kDistortionSigma, options.readout_sigma_s;
  return p;
}

std::optional<Eigen::Vector2d> ResidualOf(const IntrinsicsState& state,
                                          const RollingMeasurement& s) {
  const Eigen::Vector3d p = state.poses[s.pose] * state.points[s.point];
  if (p.z() <= 0) return std::nullopt;
  return s.inverse_sigma * (PixelOf(state.camera, p) + state.readout_s * s.by_readout - s.px);
}

// The measurements that agree with the state; points with fewer than two such measurements are
// dropped.
std::vector<RollingMeasurement> InliersOf(const Problem& problem) {
  std::vector<RollingMeasurement> inliers;
  for (size_t i = 0; i < problem.measurements.size();) {
    const size_t before = inliers.size();
    const int point = problem.measurements[i].point;
    for (; i < problem.measurements.size() && problem.measurements[i].point == point; ++i) {
      const auto residual = ResidualOf(problem.state, problem.measurements[i]);
      if (residual && residual->squaredNorm() <= kChi2TwoDof)
        inliers.push_back(problem.measurements[i]);
    }
    if (inliers.size() - before < 2) inliers.resize(before);
  }
  return inliers;
}

// The variance of the residuals, and how correlated errors of neighbours in an image are: the
// design effect, var(sum) / sum(var) over cells of the image (Kish 1965). It reveals a motion that
// the poses do not follow, a distortion that the model lacks, and matches with common errors.
struct Noise {
  double variance = 1, design_effect = 1;
};

Noise NoiseOf(const IntrinsicsState& state, std::span<const RollingMeasurement> measurements) {
  constexpr int kCells =
      8;  // along the longer side: large against patches, small against the image
  const double cell =
      std::max(state.camera.width, state.camera.height) / static_cast<double>(kCells);
  std::map<std::array<int, 3>, std::pair<Eigen::Vector2d, double>> cells;
  double sum = 0;
  std::vector<char> is_seen(state.points.size());
  int points = 0;
  for (const RollingMeasurement& s : measurements) {
    const auto residual = ResidualOf(state, s);
    if (!residual) continue;
    sum += residual->squaredNorm();
    points += !std::exchange(is_seen[s.point], 1);
    auto& [total, squares] = cells
                                 .try_emplace({s.pose, static_cast<int>(s.px.x() / cell),
                                               static_cast<int>(s.px.y() / cell)},
                                              Eigen::Vector2d::Zero(), 0.0)
                                 .first->second;
    total += *residual;
    squares += residual->squaredNorm();
  }
  double together = 0;
  for (const auto& [key, entry] : cells) together += entry.first.squaredNorm();
  const double freedom = 2.0 * static_cast<double>(measurements.size()) - 3.0 * points -
                         6.0 * static_cast<double>(state.poses.size());
  return {sum / std::max(freedom, 1.0), sum > 0 ? std::max(1.0, together / sum) : 1};
}

double ShareWithParallax(const IntrinsicsState& state,
                         std::span<const RollingMeasurement> measurements) {
  std::vector<Eigen::Vector3d> centers;
  for (const Rigid3& pose : state.poses) centers.push_back(pose.OriginInSource());
  int points = 0, with = 0;
  for (size_t i = 0; i < measurements.size();) {
    const int point = measurements[i].point;
    const Eigen::Vector3d first =
        (state.points[point] - centers[measurements[i].pose]).normalized();
    double widest = 0;
    for (; i < measurements.size() && measurements[i].point == point; ++i) {
      const Eigen::Vector3d ray =
          (state.points[point] - centers[measurements[i].pose]).normalized();
      widest = std::max(widest, first.cross(ray).norm());
    }
    ++points;
    with += widest > std::sin(kMinParallaxRad);
  }
  return points > 0 ? static_cast<double>(with) / points : 0;
}

double LargestTurn(const IntrinsicsState& state) {
  double largest = 0;
  for (const Rigid3& a : state.poses)
    largest = std::max(largest, a.rotation.angularDistance(state.poses.front().rotation));
  return largest;
}

std::string WhyNot(const SelfCalibration& found, const IntrinsicsState& state,
                   std::span<const RollingMeasurement> inliers) {
  const double focal = found.camera.fx / std::max(found.camera.width, found.camera.height);
  if (ShareWithParallax(state, inliers) < kMinParallaxShare)
    return "the camera only turned: it has to move sideways, too";
  if (!(found.RelativeSigma() <= kMaxRelativeSigma)) {
    const std::string how =
        std::isfinite(found.RelativeSigma())
            ? fmt::format("the focal length is only known to {:.1f} %", 100 * found.RelativeSigma())
            : std::string("the focal length is not determined");
    return how +
           (LargestTurn(state) < kMinTurnRad
                ? ": the camera moved without turning"
                : ": the motion tells too little of it (moving straight ahead, or a flat scene)");
  }
  if (focal < kMinFocal || focal > kMaxFocal)
    return fmt::format("no plausible focal length ({:.0f} pixels)", found.camera.fx);
  return {};
}

bool Solve(Problem& problem, const IntrinsicsPrior& known) {
  // The focal length is weakly determined: it still changes where the cost hardly does.
  constexpr int kIterations = 40;
  constexpr double kTolerance = 1e-5;
  // The principal point is fixed at first: far from the solution it would compensate for a wrong
  // focal length.
  IntrinsicsPrior held = known;
  held.camera.cx = problem.state.camera.cx;
  held.camera.cy = problem.state.camera.cy;
  held.sigma[1] = held.sigma[2] = 0;
  const SchurOptions robust{kIterations, kTolerance, kChi2TwoDof, {}};
  return MinimizeWithIntrinsics(problem.measurements, held, robust, problem.state).success &&
         MinimizeWithIntrinsics(problem.measurements, known, robust, problem.state).success;
}

// The part of a problem with the keyframes [from, to).
Problem PartOf(const Problem& whole, int from, int to) {
  Problem part;
  part.state.camera = whole.state.camera;
  part.state.readout_s = whole.state.readout_s;
  const auto ids = whole.keyframes.begin();
  part.keyframes.assign(ids + from, ids + to);
  part.state.poses.assign(whole.state.poses.begin() + from, whole.state.poses.begin() + to);
  for (size_t i = 0; i < whole.measurements.size();) {
    const size_t before = part.measurements.size();
    const int point = whole.measurements[i].point,
              new_point = static_cast<int>(part.landmarks.size());
    for (; i < whole.measurements.size() && whole.measurements[i].point == point; ++i) {
      RollingMeasurement s = whole.measurements[i];
      if (s.pose < from || s.pose >= to) continue;
      s.pose -= from;
      s.point = new_point;
      part.measurements.push_back(s);
    }
    if (part.measurements.size() - before < 2) {
      part.measurements.resize(before);
      continue;
    }
    part.landmarks.push_back(whole.landmarks[point]);
    part.state.points.push_back(whole.state.points[point]);
  }
  return part;
}

// The standard deviation of log(focal length) of a solved problem, from its own residuals; infinite
// where it is not determined.
double StatisticalSigma(const IntrinsicsState& state, std::span<const RollingMeasurement> inliers,
                        const IntrinsicsPrior& known) {
  const Noise noise = NoiseOf(state, inliers);
  const double variance = noise.variance * noise.design_effect *
                          InverseOf<kShared>(InformationOnIntrinsics(inliers, known, state))(0, 0);
  return std::isfinite(variance) && variance > 0 ? std::sqrt(variance)
                                                 : std::numeric_limits<double>::infinity();
}

// How much more the focal lengths of parts of the walk, each solved by itself, differ than their
// own standard deviations explain (Birge 1932); at least 1. It reveals errors that are constant
// within a part, such as the effect of a rolling shutter on its motion.
double BirgeRatio(const Problem& whole, const IntrinsicsPrior& known) {
  // More parts tell their spread better, but each of them needs keyframes for a focal length of its
  // own (one more than kMinKeyframes).
  constexpr int kParts = 4, kMinKeyframesOfPart = 6;
  const int count = static_cast<int>(whole.keyframes.size()),
            parts = std::min(kParts, count / kMinKeyframesOfPart);
  double sum = 0;
  int told = 0;
  for (int part = 0; part < parts; ++part) {
    Problem p = PartOf(whole, part * count / parts, (part + 1) * count / parts);
    if (p.landmarks.size() < kMinPoints ||
        !MinimizeWithIntrinsics(p.measurements, known, {20, 1e-4, 0, {}}, p.state).success)
      continue;
    const double sigma = StatisticalSigma(p.state, p.measurements, known);
    if (!std::isfinite(sigma)) continue;
    const double off = std::log(p.state.camera.fx / whole.state.camera.fx) / sigma;
    sum += off * off;
    ++told;
  }
  return told > 1 ? std::sqrt(std::max(1.0, sum / (told - 1))) : 1;
}

}  // namespace

SelfCalibration SelfCalibrate(const Map& map, int camera, const SelfCalibrationOptions& options,
                              std::span<const FramePose> trajectory) {
  Problem problem = Collect(map, camera, trajectory);
  SelfCalibration found;
  found.camera = problem.state.camera;
  found.keyframes = static_cast<int>(problem.keyframes.size());
  found.observations = static_cast<int>(problem.measurements.size());
  if (found.keyframes < kMinKeyframes || problem.landmarks.size() < kMinPoints) {
    found.why_not = fmt::format("too little was mapped: {} keyframes, {} landmarks seen twice",
                                found.keyframes, problem.landmarks.size());
    return found;
  }
  const IntrinsicsPrior known = PriorOf(problem.state.camera, options);
  if (!Solve(problem, known)) {
    found.why_not = "bundle adjustment with a free focal length finds no solution";
    return found;
  }
  std::vector<RollingMeasurement> inliers = InliersOf(problem);
  if (!MinimizeWithIntrinsics(inliers, known, {20, 1e-6, 0, {}}, problem.state).success) {
    found.why_not = "bundle adjustment with a free focal length finds no solution";
    return found;
  }
  const Noise noise = NoiseOf(problem.state, inliers);
  found.camera = problem.state.camera;
  found.readout_s = problem.state.readout_s;
  found.inliers = static_cast<int>(inliers.size());
  found.rmse = std::sqrt(noise.variance);
  const auto information = InformationOnIntrinsics(inliers, known, problem.state);
  const Eigen::Matrix<double, kShared, kShared> covariance = InverseOf<kShared>(information);
  if (covariance.allFinite() && covariance(0, 0) > 0) {
    const SharedStep sigma =
        (noise.variance * noise.design_effect * covariance.diagonal()).cwiseMax(0).cwiseSqrt();
    double parts_ratio = 1;
    if (options.compares_parts) {
      Problem kept = problem;
      kept.measurements = inliers;
      parts_ratio = BirgeRatio(kept, known);
    }
    found.focal_sigma_px = sigma[0] * found.camera.fx * parts_ratio;
    found.readout_sigma_s = sigma[kIntrinsics];
  }
  for (size_t i = 0; i < problem.keyframes.size(); ++i)
    found.poses.emplace_back(problem.keyframes[i], problem.state.poses[i]);
  for (size_t i = 0; i < problem.landmarks.size(); ++i)
    found.points.emplace_back(problem.landmarks[i], problem.state.points[i]);
  found.why_not = WhyNot(found, problem.state, inliers);
  found.success = found.why_not.empty();
  return found;
}

Map Recalibrated(const Map& map, int camera, const SelfCalibration& calibration,
                 const BundleConfig& config) {
  constexpr int kIterations = 20;  // from the solution for part of the keyframes
  Map changed = WithCamera(map, camera, calibration.camera);
  for (const auto& [id, pose] : calibration.poses)
    changed.keyframes.MutableAt(id).cam_from_world = pose;
  for (const auto& [id, point] : calibration.points)
    changed.landmarks.MutableAt(id).position = point;
  ApplyCorrection(GlobalBundleAdjustment(changed, kIterations, config), changed);
  for (const KeyframeId id : changed.keyframes.Ids()) changed.UpdateCovisibility(id);
  return changed;
}

double SelfCalibration::SureReadout() const {
  // A shorter readout moves key points by less than a pixel where the image moves by 300 px/s. Four
  // sigmas: a global shutter must not be taken for a rolling one.
  constexpr double kSigmas = 4, kMinReadoutS = 0.003;
  const double least = std::max(kMinReadoutS, kSigmas * readout_sigma_s);
  return success && std::abs(readout_s) >= least ? readout_s : 0;
}

}  // namespace oaslam
