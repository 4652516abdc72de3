#include "oaslam/matching/depth_alignment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "oaslam/estimation/levenberg_marquardt.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/pose_step.h"
#include "oaslam/map/metre.h"

namespace oaslam {
namespace {

// The standard deviation of the depth of a landmark: it is off along the ray, and so is the metre.
double SigmaOfLandmark(double z, double metre_sigma) {
  constexpr double kAlongRay = 0.02;  // a share; a guess
  return std::hypot(kAlongRay, metre_sigma) * z;
}

// A piece of a measured surface, in the frame of the camera.
struct Facet {
  Eigen::Vector3d point, normal;
  double sigma = 0;  // of the point's z
};

// The depths of a frame as surfaces.
class Surfaces {
 public:
  explicit Surfaces(const Frame& frame)
      : camera_(*frame.camera), depth_(*frame.depth), bounds_(IdealImageBounds(*frame.camera)) {}

  // Of what a pixel of the ideal image shows; nothing at edges, and where it was not measured.
  std::optional<Facet> At(const Eigen::Vector2d& px) const {
    // The share of the image's width over which a normal is taken: less, and the noise of the
    // depths turns it; more, and few things are flat.
    constexpr double kReach = 0.025;
    const auto depth = Measured(px);
    if (!depth) return std::nullopt;
    const double reach = kReach * camera_.width;
    std::array<Eigen::Vector3d, 4> around;
    for (int k = 0; k < 4; ++k) {
      const double side = k % 2 == 0 ? reach : -reach;
      const Eigen::Vector2d beside =
          px + (k < 2 ? Eigen::Vector2d(side, 0) : Eigen::Vector2d(0, side));
      const auto there = Measured(beside);
      if (!there) return std::nullopt;
      around[k] = there->z * RayOf(camera_, beside);
    }
    Facet facet{depth->z * RayOf(camera_, px),
                (around[0] - around[1]).cross(around[2] - around[3]).normalized(), depth->sigma};
    return IsFlat(facet, around) ? std::optional(facet) : std::nullopt;
  }

  // Nothing where it was not measured.
  std::optional<MeasuredDepth> Measured(const Eigen::Vector2d& px) const {
    const bool is_inside =
        px.x() >= bounds_.x1 && px.x() < bounds_.x2 && px.y() >= bounds_.y1 && px.y() < bounds_.y2;
    return is_inside ? depth_.At(Distort(camera_, px)) : std::nullopt;
  }
  const Camera& camera() const { return camera_; }

 private:
  // Whether what is around lies in one plane, and is not seen at a grazing angle.
  static bool IsFlat(const Facet& facet, const std::array<Eigen::Vector3d, 4>& around) {
    constexpr double kMostBent = 0.02, kLeastCosine = 0.2;
    const double z = facet.point.z();
    if (std::abs(facet.normal.dot(facet.point)) < kLeastCosine * facet.point.norm()) return false;
    return std::ranges::all_of(around, [&](const Eigen::Vector3d& p) {
      return std::abs(facet.normal.dot(p - facet.point)) < kMostBent * z;
    });
  }

  const Camera& camera_;
  const DepthMap& depth_;
  Box bounds_;
};

// A landmark beside the piece of surface that is seen where it projects.
struct Contact {
  Eigen::Vector3d position;  // world
  Facet facet;
  double sigma = 0;
};

PoseVector RowOf(const Eigen::Vector3d& normal, const Eigen::Vector3d& p) {
  PoseVector row;
  row << normal, p.cross(normal);
  return row;
}

struct Contacts {
  std::vector<Contact> near;
  int looked_at = 0;  // landmarks beside a surface, near or not

  // Where most landmarks would be hidden, the pose may as well be a wrong one.
  bool AreMost() const { return 2 * std::ssize(near) > looked_at; }
};

// The contacts that are as near as the uncertainty of the pose allows.
Contacts FindContacts(const Surfaces& surfaces, std::span<const Eigen::Vector3d> landmarks,
                      const AlignedPose& pose, double metre_sigma) {
  constexpr double kSigmas = 3;
  Contacts contacts;
  for (const Eigen::Vector3d& position : landmarks) {
    const Eigen::Vector3d p = pose.cam_from_world * position;
    if (!(p.z() > kMinDepth)) continue;
    const auto facet = surfaces.At(ProjectIdeal(surfaces.camera(), p));
    if (!facet) continue;
    ++contacts.looked_at;
    const double sigma = std::hypot(facet->sigma, SigmaOfLandmark(p.z(), metre_sigma)) *
                         std::abs(facet->normal.dot(p)) / p.z();
    const PoseVector row = RowOf(facet->normal, p);
    const double of_pose = std::sqrt(std::max(0.0, row.dot(pose.covariance * row)));
    if (std::abs(facet->normal.dot(p - facet->point)) < kSigmas * std::hypot(sigma, of_pose))
      contacts.near.push_back({position, *facet, sigma});
  }
  return contacts;
}

// What all contacts are off by together does not become less by their number: more than kMost count
// as kMost.
NormalEquations<6> Linearize(const std::vector<Contact>& contacts, const Rigid3& pose) {
  constexpr double kMost = 60;
  const double share = std::min(1.0, kMost / static_cast<double>(contacts.size()));
  NormalEquations<6> n;
  for (const Contact& contact : contacts) {
    const Eigen::Vector3d p = pose * contact.position;
    const double error = contact.facet.normal.dot(p - contact.facet.point) / contact.sigma,
                 ratio = error * error / kChi2OneDof;
    const PoseVector row = RowOf(contact.facet.normal, p) / contact.sigma;
    const double weight = share / (1 + ratio);
    n.cost += share * kChi2OneDof * std::log1p(ratio);
    n.hessian.noalias() += weight * row * row.transpose();
    n.gradient += weight * error * row;
  }
  return n;
}

}  // namespace

std::vector<Eigen::Vector3d> LandmarksBeforeDepths(const Frame& frame, const Map& map,
                                                   const Rigid3& cam_from_world) {
  constexpr size_t kMost = 600;    // bounds the time
  constexpr double kBehind = 0.3;  // a share of the depth
  std::vector<Eigen::Vector3d> positions;
  if (!frame.depth || !SigmaOfMetre(map)) return positions;
  const Surfaces surfaces(frame);
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    const Eigen::Vector3d p = cam_from_world * landmark.position;
    if (!(p.z() > kMinDepth)) return;
    const auto depth = surfaces.Measured(ProjectIdeal(*frame.camera, p));
    if (depth && p.z() < (1 + kBehind) * depth->z) positions.push_back(landmark.position);
  });
  if (positions.size() <= kMost) return positions;
  std::vector<Eigen::Vector3d> some;
  for (size_t i = 0; i < kMost; ++i) some.push_back(positions[i * positions.size() / kMost]);
  return some;
}

std::optional<AlignedPose> AlignToDepths(const Frame& frame,
                                         std::span<const Eigen::Vector3d> landmarks,
                                         const AlignedPose& prior, double metre_sigma) {
  constexpr size_t kLeastContacts = 30;
  constexpr int kRounds = 6, kIterations = 3;
  const auto information = InverseOfInformation<6>(prior.covariance);
  if (!information || landmarks.size() < kLeastContacts) return std::nullopt;
  const Surfaces surfaces(frame);
  const Rigid3 world_from_prior = prior.cam_from_world.Inverse();
  AlignedPose pose = prior;
  for (int round = 0; round < kRounds; ++round) {
    const Contacts contacts = FindContacts(surfaces, landmarks, pose, metre_sigma);
    if (contacts.near.size() < kLeastContacts) return std::nullopt;
    if (round + 1 == kRounds && !contacts.AreMost()) return std::nullopt;
    const NormalEquations<6> end = MinimizeDense<6>(
        {.max_iterations = kIterations}, pose.cam_from_world,
        [&](const Rigid3& at) {
          NormalEquations<6> n = Linearize(contacts.near, at);
          const PoseVector moved = StepOf(at * world_from_prior);
          n.hessian += *information;
          n.gradient += *information * moved;
          n.cost += moved.dot(*information * moved);
          return n;
        },
        [](const Rigid3& at, const PoseVector& step) { return std::optional(Moved(at, step)); });
    const auto now = CovarianceOf(end);
    if (!now) return std::nullopt;
    // The surfaces that the first rounds found may be the wrong ones: the gate closes slowly.
    constexpr double kSlower = 0.5;
    const double of_before = round + 1 == kRounds ? 0 : kSlower;
    pose.covariance = (1 - of_before) * *now + of_before * pose.covariance;
  }
  return pose;
}

bool DepthAgreement::Contradicts() const {
  constexpr int kLeast = 20;
  constexpr double kMost = 0.25;  // of these; one in ten where poses are right
  return agree + seen_through >= kLeast && seen_through > kMost * (agree + seen_through);
}

DepthAgreement CompareDepths(const Frame& frame, std::span<const Eigen::Vector3d> landmarks,
                             const AlignedPose& pose, double metre_sigma) {
  constexpr double kSigmas = 3;
  const Surfaces surfaces(frame);
  DepthAgreement agreement;
  for (const Eigen::Vector3d& position : landmarks) {
    const Eigen::Vector3d p = pose.cam_from_world * position;
    if (!(p.z() > kMinDepth)) continue;
    const auto depth = surfaces.Measured(ProjectIdeal(*frame.camera, p));
    if (!depth) continue;
    const PoseVector row = RowOf(Eigen::Vector3d::UnitZ(), p);
    const double of_pose = std::max(0.0, row.dot(pose.covariance * row)),
                 of_depth = std::hypot(depth->sigma, SigmaOfLandmark(p.z(), metre_sigma)),
                 off = depth->z - p.z();
    if (std::abs(off) <= kSigmas * std::sqrt(of_pose + of_depth * of_depth))
      ++agreement.agree;
    else if (off > 0)
      ++agreement.seen_through;
  }
  return agreement;
}

}  // namespace oaslam
