#include "oaslam/matching/depth_agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ideal_image.h"
#include "oaslam/map/metre.h"
#include "oaslam/matching/depth_alignment.h"

namespace oaslam {
void MeasureDepths(const Frame& frame, const Map& map, MatchedPoints& matched) {
  const std::optional<double> metre = frame.depth ? SigmaOfMetre(map) : std::nullopt;
  if (!metre) return;
  for (PointObservation& o : matched.observations)
    if (const auto depth = frame.depth->At(Distort(*frame.camera, o.px))) {
      o.depth = depth->z;
      o.depth_sigma = std::hypot(depth->sigma, std::hypot(*metre, kLandmarkDepthSigma) * depth->z);
    }
}

bool DepthAgreement::Contradicts() const {
  constexpr int kLeast = 20;
  constexpr double kMost = 0.25;  // of these; one in ten where poses are right
  return agree + seen_through >= kLeast && seen_through > kMost * (agree + seen_through);
}

DepthAgreement CompareDepths(const Frame& frame, const Map& map, const Rigid3& cam_from_world,
                             double sigma_position) {
  constexpr double kSigmas = 3;
  DepthAgreement agreement;
  const std::optional<double> metre = frame.depth ? SigmaOfMetre(map) : std::nullopt;
  if (!metre) return agreement;
  const Box bounds = IdealImageBounds(*frame.camera);
  map.landmarks.ForEach([&](LandmarkId, const Landmark& landmark) {
    const Eigen::Vector3d p = cam_from_world * landmark.position;
    if (!(p.z() > kMinDepth)) return;
    const Eigen::Vector2d px = ProjectIdeal(*frame.camera, p);
    if (!(px.x() >= bounds.x1 && px.x() < bounds.x2 && px.y() >= bounds.y1 && px.y() < bounds.y2))
      return;
    const auto depth = frame.depth->At(Distort(*frame.camera, px));
    if (!depth) return;
    const double relative = std::hypot(*metre, kLandmarkDepthSigma) * p.z(),
                 sigma = std::hypot(std::hypot(depth->sigma, relative), sigma_position),
                 off = depth->z - p.z();
    if (std::abs(off) <= kSigmas * sigma)
      ++agreement.agree;
    else if (off > 0)
      ++agreement.seen_through;
  });
  return agreement;
}

bool RefuseByDepths(const Frame& frame, const Map& map, Relocalization& found) {
  constexpr double kContradicted = 0.3;  // the most confidence of such a pose; a guess
  if (const auto aligned = AlignToDepths(frame, map, found.cam_from_world, found.covariance)) {
    found.cam_from_world = aligned->cam_from_world;
    found.covariance = aligned->covariance;
  }
  const DepthAgreement agreement =
      CompareDepths(frame, map, found.cam_from_world, found.sigma_position());
  if (!agreement.Contradicts()) return false;
  found.evidence = PoseEvidence::kNone;
  found.confidence = std::min(found.confidence, kContradicted);
  found.why_not =
      fmt::format("the depth camera sees through {} of {} points that the best pose puts in view",
                  agreement.seen_through, agreement.agree + agreement.seen_through);
  return true;
}

}  // namespace oaslam
