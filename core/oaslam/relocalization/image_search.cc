#include "oaslam/relocalization/image_search.h"

#include <algorithm>

#include "oaslam/error.h"
#include "oaslam/map/camera_replacement.h"
#include "oaslam/relocalization/depth_registration.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

// The answer of a search, which gets a fresh random generator: none depends on the images before.
template <typename Search>
RelocalizationResult AnswerOf(const SlamConfig& config, double ms_features, const Search& search) {
  Rng rng(static_cast<uint64_t>(config.runner.seed));
  const Stopwatch watch;
  RelocalizationResult result = ResultOf(search(rng));
  result.ms_features = ms_features;
  result.ms = watch.WallMs();
  return result;
}

}  // namespace

RelocalizationResult ResultOf(const Relocalization& found) {
  RelocalizationResult result;
  result.evidence = found.evidence;
  if (found.IsFound()) {
    result.world_from_cam = found.cam_from_world.Inverse();
    result.camera = found.camera;
    if (found.camera) result.focal_sigma_px = found.focal_sigma * found.camera->fx;
  }
  result.confidence = found.confidence;
  result.object_score = found.objects.score;
  result.object_margin = found.objects.margin;
  result.inlier_points = found.points.inliers;
  result.matched_objects = static_cast<int>(found.objects.matched.size());
  result.covariance = found.covariance;
  result.sigma_position = found.sigma_position();
  for (const PoseHypothesis& h : found.candidates)
    result.candidates.push_back({h.cam_from_world.Inverse(), h.score});
  result.candidates_are_by = found.candidates_are_by;
  result.why_not = found.why_not;
  return result;
}

void CheckOptions(const RelocalizeOptions& options, const ImageInput& input) {
  CheckMode(options.mode);
  CheckPose(options.prior);
  CheckGravity(input.gravity_in_cam);
  if (options.camera) CheckCamera(*options.camera);
  const bool has_image = !input.image.empty();
  if (options.camera && options.unknown_camera)
    throw InputError("relocalize: a camera is given, and said to be unknown");
  if (!has_image && options.unknown_camera)
    throw InputError("relocalize: without an image the camera must be known");
  if ((has_image || input.features) && options.follow)
    throw InputError("relocalize: only boxes are followed: give no image, or use Process");
}

Camera UnknownCamera(const cv::Size& size) {
  Camera camera;
  camera.width = size.width;
  camera.height = size.height;
  camera.fx = camera.fy = std::max(camera.width, camera.height);
  camera.cx = (camera.width - 1) / 2.0;
  camera.cy = (camera.height - 1) / 2.0;
  CheckCamera(camera);
  return camera;
}

RelocalizationResult FindImage(const ImageInput& input, const Camera& camera,
                               const RelocalizeOptions& options, const Map& map,
                               const SlamConfig& config, FrameMaker& maker,
                               Relocalizer& relocalizer) {
  const Stopwatch watch;
  const bool has_points = !input.image.empty() || input.features;
  Frame frame;
  if (has_points) {
    frame = maker.Make(input, 0, config.features.count, map.classes);
  } else {
    frame.camera = std::make_shared<const Camera>(camera);
    frame.detections = CheckedDetections(camera, input.detections);
    frame.gravity_in_cam = input.gravity_in_cam;
  }
  if (input.depth) frame.depth = DepthRegistration().Register(*input.depth, camera);
  const RelocalizationMode mode = has_points ? options.mode : RelocalizationMode::kObjects;
  return AnswerOf(config, watch.WallMs(), [&](Rng& rng) {
    return relocalizer.Find(frame, map, mode, rng, nullptr, options.prior);
  });
}

RelocalizationResult FindWithUnknownCamera(const ImageInput& input, const Camera& camera,
                                           const RelocalizeOptions& options, const Map& map,
                                           const SlamConfig& config, FrameMaker& maker,
                                           Relocalizer& relocalizer) {
  const Stopwatch watch;
  Camera plain = camera;
  plain.model = LensModel::kPinhole;
  plain.distortion = {};
  Frame frame = maker.Make(input, 0, config.features.count, map.classes);
  frame.camera = std::make_shared<const Camera>(plain);
  frame.features = std::make_shared<const Features>(WithCamera(*frame.features, camera, plain));
  frame.detections = IdealDetections(plain, input.detections);
  return AnswerOf(config, watch.WallMs(), [&](Rng& rng) {
    return relocalizer.FindWithUnknownCamera(frame, map, options.mode, rng);
  });
}

}  // namespace oaslam
