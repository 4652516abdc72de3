#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/camera_replacement.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/relocalization/frame_search.h"

namespace oaslam {
namespace {

// The camera scaled to another image size; nothing where the aspect ratio differs.
std::optional<Camera> ForSize(const Camera& camera, int width, int height) {
  constexpr double kSameShape = 0.01;  // relative; rounding of the size of a scaled image
  const double scale = static_cast<double>(width) / camera.width;
  if (std::abs(scale * camera.height / height - 1) > kSameShape) return std::nullopt;
  return Scaled(camera, width, height);
}

bool IsNearlyTheSame(const Camera& a, const Camera& b) {
  constexpr double kLittle = 0.02;
  const auto zoom = ZoomBetween(a, b);
  return zoom && std::abs(std::log(*zoom)) < kLittle;
}

// The cameras of the keyframes, newest first, scaled to the size of the image. Of those that differ
// in the focal length by little, as where the lens focused anew, one: a search finds what it sees.
std::vector<Camera> CamerasOfMap(const Map& map, const Camera& of_image) {
  std::set<int> used;
  map.keyframes.ForEach([&](KeyframeId, const Keyframe& k) { used.insert(k.camera); });
  std::vector<Camera> cameras;
  for (auto index = used.rbegin(); index != used.rend(); ++index)
    if (const auto camera =
            ForSize(map.cameras[static_cast<size_t>(*index)], of_image.width, of_image.height);
        camera && std::ranges::none_of(cameras, [&](const Camera& other) {
          return IsNearlyTheSame(other, *camera);
        }))
      cameras.push_back(*camera);
  return cameras;
}

// A frame converted to the ideal image of a candidate camera.
Frame SeenBy(const Camera& camera, const Frame& raw) {
  Frame seen = raw;
  seen.camera = std::make_shared<const Camera>(camera);
  seen.features = std::make_shared<const Features>(WithCamera(*raw.features, *raw.camera, camera));
  for (ObjectDetection& d : seen.detections) d.box = UndistortBox(camera, d.box);
  return seen;
}

// Whether the points contradict the focal length of a camera. The bound is ten sigmas wide, since
// errors of points are correlated and the covariance is too small.
enum class Contradiction { kNone, kPossible, kCertain };

Contradiction ContradictionOf(const Relocalization& refined, const Camera& camera) {
  constexpr double kSigmas = 10, kTolerance = 0.02, kSuspicious = 0.05;
  const double off = std::abs(std::log(refined.camera->fx / camera.fx)),
               bound = std::max(kTolerance, kSigmas * refined.focal_sigma);
  if (!(off < bound)) return Contradiction::kCertain;
  return off < kSuspicious ? Contradiction::kNone : Contradiction::kPossible;
}

}  // namespace

Relocalization FindWithUnknownCamera(const SearchTools& tools, const Map& map, const Frame& raw,
                                     const std::function<std::optional<Frame>()>& learned) {
  const RelocalizationConfig& config = tools.config.relocalization;
  std::optional<std::optional<Frame>> described;  // when first needed: it takes time
  const auto raw_learned = [&]() -> const std::optional<Frame>& {
    if (!described) described = learned();
    return *described;
  };
  Relocalization best;
  best.why_not = "no camera of the map takes images of this shape";
  const std::vector<Camera> cameras = CamerasOfMap(map, *raw.camera);
  for (const Camera& camera : cameras) {
    const Frame seen = SeenBy(camera, raw);
    Relocalization found = FrameSearch(tools, map).Find(seen, [&] {
      return raw_learned() ? std::optional(SeenBy(camera, *raw_learned())) : std::nullopt;
    });
    if (!found.IsFound()) {
      if (best.candidates.empty()) best = std::move(found);
      continue;
    }
    const bool has_points = found.evidence != PoseEvidence::kObjects;
    const Contradiction contradiction =
        has_points
            ? ContradictionOf(RefineFocal(seen, map, found, config.accept_confidence), camera)
            : Contradiction::kPossible;
    if (contradiction == Contradiction::kCertain) {
      if (!best.IsFound())
        best.why_not = "its points contradict the focal lengths of the map's cameras";
      continue;
    }
    if (!best.IsFound() || found.points.inliers > best.points.inliers) {
      best = std::move(found);
      best.camera = camera;
    }
    if (contradiction == Contradiction::kNone) return best;
  }
  if (!tools.places) return best;
  const auto find_focal = [&](const Frame& frame, Appearance appearance) {
    return RelocalizeByPointsAndFocal(frame, map, *tools.places, config, tools.rng, appearance);
  };
  Relocalization free = find_focal(raw, Appearance::kOrb);
  if (!free.IsFound() && !best.IsFound() && raw_learned())
    free = find_focal(*raw_learned(), Appearance::kLearned);
  if (!free.IsFound() || (best.IsFound() && free.points.inliers <= best.points.inliers)) {
    if (cameras.empty()) best.why_not = free.why_not;
    return best;
  }
  free.camera->is_guess = false;
  free.camera->name = "estimated";
  LeadWithAccepted(free);
  return free;
}

}  // namespace oaslam
