#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/localization/relocalizer.h"
#include "oaslam/map/camera_replacement.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/relocalization/confidence.h"

namespace oaslam {
namespace {

// The camera scaled to another image size; nothing where the aspect ratio differs.
std::optional<Camera> ForSize(const Camera& camera, int width, int height) {
  constexpr double kSameShape = 0.01;  // relative; rounding of the size of a scaled image
  const double scale = static_cast<double>(width) / camera.width;
  if (std::abs(scale * camera.height / height - 1) > kSameShape) return std::nullopt;
  return Scaled(camera, width, height);
}

// The cameras of the keyframes, newest first, scaled to the size of the image.
std::vector<Camera> CamerasOfMap(const Map& map, const Camera& of_image) {
  std::set<int> used;
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& k) { used.insert(k.camera); });
  std::vector<Camera> cameras;
  for (auto index = used.rbegin(); index != used.rend(); ++index)
    if (const auto camera =
            ForSize(map.cameras[static_cast<size_t>(*index)], of_image.width, of_image.height))
      cameras.push_back(*camera);
  return cameras;
}

// A frame converted to the ideal image of a candidate camera, and a copy of the map with that
// camera as its last.
struct Seen {
  Map map;
  Frame frame;
};

Seen SeenBy(const Camera& camera, const Frame& raw, const Map& map) {
  const Camera& plain = map.cameras[static_cast<size_t>(raw.camera)];
  Seen seen{map, raw};
  seen.map.cameras.push_back(camera);
  seen.frame.camera = static_cast<int>(seen.map.cameras.size()) - 1;
  seen.frame.features = std::make_shared<const Features>(WithCamera(*raw.features, plain, camera));
  for (ObjectDetection& d : seen.frame.detections) d.box = UndistortBox(camera, d.box);
  return seen;
}

// Whether the points contradict the focal length of a camera. The bound is ten sigmas wide, since
// errors of points are correlated and the covariance is too small.
enum class Contradiction { kNone, kPossible, kCertain };

Contradiction ContradictionOf(const FocalRelocalization& refined, const Camera& camera) {
  constexpr double kSigmas = 10, kTolerance = 0.02, kSuspicious = 0.05;
  const double off = std::abs(std::log(refined.camera.fx / camera.fx)),
               bound = std::max(kTolerance, kSigmas * refined.relative_sigma);
  if (!(off < bound)) return Contradiction::kCertain;
  return off < kSuspicious ? Contradiction::kNone : Contradiction::kPossible;
}

}  // namespace

UnknownCameraRelocalization Relocalizer::FindWithUnknownCamera(
    const Frame& raw, const Map& map, RelocalizationMode mode,
    const std::optional<Eigen::Vector3d>& gravity_in_cam, Rng& rng) {
  UnknownCameraRelocalization best;
  const Camera& plain = map.cameras[static_cast<size_t>(raw.camera)];
  best.camera = plain;
  best.found.why_not = "no camera of the map takes images of this shape";
  const std::vector<Camera> cameras = CamerasOfMap(map, plain);
  for (const Camera& camera : cameras) {
    const Seen seen = SeenBy(camera, raw, map);
    Relocalization found = Find(seen.frame, seen.map, mode, gravity_in_cam, rng);
    if (found.evidence == PoseEvidence::kNone) {
      if (best.found.candidates.empty()) best.found = std::move(found);
      continue;
    }
    RelocalizationReport report;
    report.cam_from_world = found.cam_from_world;
    report.landmarks = found.landmarks;
    report.inliers = found.inliers;
    const bool has_points = found.evidence != PoseEvidence::kObjects;
    const FocalRelocalization refined =
        RefineFocal(seen.frame, seen.map, report, config_.relocalization.accept_confidence);
    const Contradiction contradiction =
        has_points ? ContradictionOf(refined, camera) : Contradiction::kPossible;
    if (contradiction == Contradiction::kCertain) {
      if (best.found.evidence == PoseEvidence::kNone)
        best.found.why_not = "its points contradict the focal lengths of the map's cameras";
      continue;
    }
    if (best.found.evidence == PoseEvidence::kNone || found.inliers > best.found.inliers) {
      best.found = std::move(found);
      best.camera = camera;
    }
    if (contradiction == Contradiction::kNone) return best;
  }
  if (mode == RelocalizationMode::kObjects) return best;
  const FocalRelocalization free =
      RelocalizeByPointsAndFocal(raw, map, IndexOf(map), config_.relocalization, rng);
  if (!free.report.success ||
      (best.found.evidence != PoseEvidence::kNone && free.report.inliers <= best.found.inliers)) {
    if (cameras.empty()) best.found.why_not = free.report.why_not;
    return best;
  }
  best.found = {};
  best.found.evidence = PoseEvidence::kPoints;
  best.found.cam_from_world = free.report.cam_from_world;
  best.found.landmarks = free.report.landmarks;
  best.found.inliers = free.report.inliers;
  best.found.sigma_position = free.report.sigma_position;
  best.found.confidence = free.report.confidence;
  best.found.candidates = free.report.hypotheses;
  LeadWithAccepted(best.found);
  best.camera = free.camera;
  best.camera.is_guess = false;
  best.camera.name = "estimated";
  best.relative_sigma = free.relative_sigma;
  return best;
}

}  // namespace oaslam
