#include "oaslam/relocalization/object_refinement.h"

#include <algorithm>
#include <cmath>

#include "oaslam/estimation/assignment.h"
#include "oaslam/estimation/ellipsoid_residuals.h"
#include "oaslam/estimation/hidden_edges.h"
#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/geometry/box.h"
#include "oaslam/geometry/decompositions.h"
#include "oaslam/geometry/degree.h"

namespace oaslam {
namespace {

// Scale of the kernel in sigma; with 2.5, fewer poses were within 5 cm (docs/lab).
constexpr double kCauchy = 0.8;
// How level a hand holds a camera, and the error of a phone's sensor with its mounting.
constexpr double kRollSigma = 8 * kDegree, kGravitySigma = 2 * kDegree;
// An object of which at least this share is in the image, and of this size in detector pixels,
// should have been detected (as in objects/association.cc).
constexpr double kMissedShare = 0.8, kMissedSizePx = 14;
// An object of which more than this share is behind something that moves is not expected (as
// kMaxHiddenShare of objects/presence.h).
constexpr double kHiddenShare = 0.3;
constexpr int kRounds = 3,
              kIterationsPerRound = 4;  // each round matches anew; poses hardly change in a fourth

// A detection matched with an object, and the inverse standard deviations of the edges at the pose
// where they were matched.
struct Match {
  int detection = 0, object = 0;
  double score = 0;
  unsigned char truncated = 0;  // edges that the image's border or a nearer object hides
  Eigen::Vector4d inverse_sigma;
};

struct Matching {
  std::vector<Match> matches;
  double llr = 0, penalty = 0;
};

// An object that is at least partly in the image for a given pose.
struct Seen {
  Seen(int o, const EllipsoidView& v, const Box& b) : object(o), view(v), box(b) {}

  int object;
  EllipsoidView view;
  Box box;
  Eigen::Vector4d variance = Eigen::Vector4d::Zero();  // of the edges of its box
  // Hidden edges count one-sided in the refinement of the pose; the score, which is evidence for
  // the pose, counts all edges.
  unsigned char hidden = 0;
  bool is_expected = false;  // it should have been detected
};

// The objects near enough to be detected or to count as missed. Refinement may halve the distance
// of the camera.
std::vector<int> FindNear(const ObjectScene& scene, const Rigid3& pose) {
  double least_px = kMissedSizePx * scene.score.pixel_unit();
  for (const SceneDetection& d : scene.detections) least_px = std::min(least_px, d.size);
  const double farthest = 2 * 2 * std::max(scene.camera.fx, scene.camera.fy) / least_px;  // reaches
  const Eigen::Vector3d eye = pose.OriginInSource();
  std::vector<int> near;
  for (int o = 0; o < static_cast<int>(scene.spheres.size()); ++o)
    if ((scene.spheres[o].head<3>() - eye).squaredNorm() <
        std::pow(farthest * scene.spheres[o].w(), 2))
      near.push_back(o);
  return near;
}

std::vector<Seen> FindInView(const ObjectScene& scene, const std::vector<int>& near,
                             const Rigid3& pose) {
  std::vector<Seen> in_view;
  const Eigen::Matrix3d rotation = pose.rotation.toRotationMatrix();
  for (const int o : near) {
    const Eigen::Vector3d center = rotation * scene.spheres[o].head<3>() + pose.translation;
    if (!MayOverlap(scene.image.bounds(), scene.camera, center, scene.spheres[o].w())) continue;
    const auto view = ViewEllipsoid(scene.objects[o].ellipsoid, pose);
    if (!view) continue;
    const Box box = OutlineBox(view->outline, scene.camera);
    if (Intersection(box, scene.image.bounds()).Area() > 0) in_view.push_back(Seen(o, *view, box));
  }
  return in_view;
}

std::vector<Box> NearerBoxes(const ObjectScene& scene, const std::vector<Seen>& in_view,
                             const Seen& than) {
  std::vector<Box> nearer;
  for (const Seen& other : in_view)
    if (other.view.center.z() + scene.objects[other.object].radius < than.view.center.z() &&
        !scene.AreTogether(other.object, than.object))
      nearer.push_back(other.box);
  return nearer;
}

bool IsBehindMoving(const ObjectScene& scene, const Box& box) {
  return std::ranges::any_of(
      scene.moving, [&](const Box& moving) { return ShareInside(box, moving) > kHiddenShare; });
}

// An object is not expected where a part of it, or the whole it belongs to, is matched: detectors
// find wholes from afar and parts from near.
void ExcusePartsAndWholes(const ObjectScene& scene, const std::vector<Match>& matches,
                          std::vector<Seen>& in_view) {
  if (scene.classes.whole_of.empty()) return;
  for (Seen& seen : in_view)
    if (seen.is_expected && std::ranges::any_of(matches, [&](const Match& m) {
          return scene.AreTogether(m.object, seen.object);
        }))
      seen.is_expected = false;
}

Matching MatchBoxes(const ObjectScene& scene, const std::vector<int>& near, const Rigid3& pose) {
  Matching result;
  std::vector<Seen> in_view = FindInView(scene, near, pose);
  const auto detections = static_cast<Eigen::Index>(scene.detections.size());
  const auto objects = static_cast<Eigen::Index>(in_view.size());
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(detections, objects);
  for (Eigen::Index o = 0; o < objects; ++o) {
    Seen& seen = in_view[o];
    const SceneObject& object = scene.objects[seen.object];
    seen.is_expected = SizeOf(seen.box) > kMissedSizePx * scene.score.pixel_unit() &&
                       scene.image.ShareShown(seen.box) > kMissedShare &&
                       !IsBehindMoving(scene, seen.box);
    if (object.detections.empty()) continue;
    seen.variance = EdgeVariance(seen.view, scene.camera, *object.covariance);
    seen.hidden =
        HiddenEdges(seen.box, NearerBoxes(scene, in_view, seen), scene.score.pixel_unit());
    for (const auto& [d, log_agreement] : object.detections)
      scores(d, o) = std::max(
          0.0, log_agreement + scene.score(scene.detections[d].box, scene.detections[d].truncated,
                                           seen.box, seen.variance));
  }
  // Where the detector gives few boxes for the objects in view, each missing detection counts less.
  const auto in_sight = static_cast<double>(std::ranges::count(in_view, true, &Seen::is_expected));
  const double recall = std::min((static_cast<double>(detections) + 1) / (in_sight + 1), 1.0);
  const std::vector<int> assigned = AssignMaximum(scores);
  for (int d = 0; d < static_cast<int>(assigned.size()); ++d) {
    if (assigned[d] < 0) continue;
    Seen& seen = in_view[assigned[d]];
    const double sigma = scene.score.DetectorSigma(scene.detections[d].box),
                 score = scores(d, assigned[d]);
    const auto truncated = static_cast<unsigned char>(scene.detections[d].truncated | seen.hidden);
    result.matches.push_back(
        {d, seen.object, score, truncated, (seen.variance.array() + sigma * sigma).rsqrt()});
    result.llr += score;
    seen.is_expected = false;
  }
  ExcusePartsAndWholes(scene, result.matches, in_view);
  for (const Seen& seen : in_view)
    if (seen.is_expected)
      result.penalty -= std::log(1 - recall * scene.objects[seen.object].detection_rate);
  return result;
}

// By how many sigmas the surface of an object is off the one that was measured in its box.
struct SurfaceError {
  double value = 0, sigma = 1;
};
std::optional<SurfaceError> SurfaceErrorOf(const ObjectScene& scene, const Match& match,
                                           const Rigid3& pose) {
  const SceneDetection& detection = scene.detections[match.detection];
  if (!(detection.surface > 0) || match.truncated) return std::nullopt;
  const SurfaceDepth surface = SurfaceDepthOf(scene.objects[match.object].ellipsoid, pose);
  const double sigma = SigmaOfSurface(surface.half_axis, detection.surface);
  return SurfaceError{(surface.z - detection.surface) / sigma, sigma};
}

struct PoseEquations {
  Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Zero();
  PoseVector gradient = PoseVector::Zero();
  double cost = 0;
};

// Adds a prior on the vertical: the direction measured by a sensor, or a horizon as level as in the
// mapping images. Under a small rotation w of the camera the vertical u changes by w x u.
void AddUprightPrior(const ObjectScene& scene, const Rigid3& pose, PoseEquations& equations) {
  if (!scene.up) return;
  const Eigen::Vector3d u = pose.rotation * *scene.up;
  const auto add = [&](double residual, const Eigen::Vector3d& by_turn) {
    equations.hessian.bottomRightCorner<3, 3>() += by_turn * by_turn.transpose();
    equations.gradient.tail<3>() += residual * by_turn;
    equations.cost += residual * residual;
  };
  if (scene.up_in_cam) {
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
      add((u - *scene.up_in_cam)[k] / kGravitySigma, u.cross(axis) / kGravitySigma);
    }
  } else {
    const Eigen::Vector3d side(std::cos(scene.attitudes.mean_roll),
                               std::sin(scene.attitudes.mean_roll), 0);
    add(u.dot(side) / kRollSigma, u.cross(side) / kRollSigma);
  }
}

void AddPrior(const PosePrior& prior, const Rigid3& pose, PoseEquations& equations) {
  const Rigid3 motion = pose * prior.cam_from_world.Inverse();
  const Eigen::AngleAxisd turn(motion.rotation);
  PoseVector change;
  change << motion.translation, turn.angle() * turn.axis();
  equations.hessian += prior.information;
  equations.gradient += prior.information * change;
  equations.cost += change.dot(prior.information * change);
}

// What a pose is refined with, besides the matches.
struct Evidence {
  const ObjectScene& scene;
  const std::optional<PosePrior>& prior;
};

PoseEquations EquationsAt(const Evidence& evidence, const std::vector<Match>& matches,
                          const Rigid3& pose, bool with_derivatives) {
  const ObjectScene& scene = evidence.scene;
  PoseEquations equations;
  AddUprightPrior(scene, pose, equations);
  if (evidence.prior) AddPrior(*evidence.prior, pose, equations);
  constexpr double kBehindCost = 100;  // more than a box in front of the camera can cost
  for (const Match& match : matches) {
    const SceneDetection& detection = scene.detections[match.detection];
    const auto view = ViewEllipsoid(scene.objects[match.object].ellipsoid, pose);
    if (!view) {
      equations.cost += kBehindCost;
      continue;
    }
    const Eigen::Vector4d residual =
        EdgeResidual(OutlineBox(view->outline, scene.camera), detection.box, match.truncated)
            .cwiseProduct(match.inverse_sigma);
    const Eigen::Array4d ratio = residual.array().square() / (kCauchy * kCauchy);
    equations.cost += kCauchy * kCauchy * (1 + ratio).log().sum();
    const auto surface = SurfaceErrorOf(scene, match, pose);
    if (surface)
      equations.cost += kCauchy * kCauchy * std::log1p(std::pow(surface->value / kCauchy, 2));
    if (!with_derivatives) continue;
    const EdgesByPose jacobian =
        match.inverse_sigma.asDiagonal() * DifferentiateByPose(*view, scene.camera);
    for (int row = 0; row < 4; ++row) {
      if ((match.truncated & (1 << row)) && residual[row] == 0) continue;
      const PoseVector j = jacobian.row(row).transpose();
      const double weight = 1 / (1 + ratio[row]);
      equations.hessian.noalias() += weight * j * j.transpose();
      equations.gradient.noalias() += weight * residual[row] * j;
    }
    if (surface) {
      const Eigen::Vector3d& center = view->center;
      PoseVector j;
      j << 0, 0, 1, center.y(), -center.x(), 0;
      j /= surface->sigma;
      const double weight = 1 / (1 + std::pow(surface->value / kCauchy, 2));
      equations.hessian.noalias() += weight * j * j.transpose();
      equations.gradient.noalias() += weight * surface->value * j;
    }
  }
  return equations;
}

// The matched boxes of a pose, for MinimizeLevenbergMarquardt.
struct MatchedBoxes {
  const Evidence& evidence;
  const std::vector<Match>& matches;
  PoseEquations equations{};

  double Cost(const Rigid3& pose) const { return EquationsAt(evidence, matches, pose, false).cost; }
  void Linearize(const Rigid3& pose) { equations = EquationsAt(evidence, matches, pose, true); }
  bool Step(double damping, Rigid3& pose) const {
    Eigen::Matrix<double, 6, 6> damped = equations.hessian;
    damped.diagonal() +=
        (damping * damped.diagonal().array() + 1e-9 * damped.diagonal().maxCoeff()).matrix();
    const PoseVector step = -SolveSymmetric<6>(damped, equations.gradient);
    if (!step.allFinite()) return false;
    pose = Moved(pose, step);
    return true;
  }
};

Eigen::Matrix<double, 6, 6> CovarianceOf(const Evidence& evidence,
                                         const std::vector<Match>& matches, const Rigid3& pose) {
  Eigen::Matrix<double, 6, 6> information = EquationsAt(evidence, matches, pose, true).hessian;
  information.diagonal().array() += 1e-9 * information.diagonal().maxCoeff() + 1e-12;
  return InverseOfSymmetric<6>(information);
}

}  // namespace

Relocalization RefineObjectPose(const ObjectScene& scene, const PoseHypothesis& start,
                                const std::optional<PosePrior>& prior) {
  const Evidence evidence{scene, prior};
  Relocalization found;
  Rigid3& pose = found.cam_from_world = start.cam_from_world;
  const std::vector<int> near = FindNear(scene, pose);
  Matching matching = MatchBoxes(scene, near, pose);
  for (int round = 0; round < kRounds && !matching.matches.empty(); ++round) {
    MatchedBoxes boxes{evidence, matching.matches};
    MinimizeLevenbergMarquardt(
        boxes, {.max_iterations = kIterationsPerRound, .damping = 1e-3, .lower = 5}, pose);
    matching = MatchBoxes(scene, near, pose);
  }
  const auto count = static_cast<double>(matching.matches.size());
  ObjectSupport& objects = found.objects;
  objects.depth = start.depth;
  objects.score =
      matching.llr * count / static_cast<double>(scene.detections.size()) - matching.penalty;
  double distance = 0;
  for (const Match& match : matching.matches) {
    const SceneObject& object = scene.objects[match.object];
    objects.matched.emplace_back(scene.detections[match.detection].index, object.id);
    distance += (pose * object.ellipsoid.center).norm();
  }
  if (matching.matches.empty()) return found;
  found.covariance = CovarianceOf(evidence, matching.matches, pose);
  objects.relative_sigma = found.sigma_position() * count / distance;
  return found;
}

}  // namespace oaslam
