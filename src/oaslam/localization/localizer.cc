#include "oaslam/localization/localizer.h"

#include <utility>

#include "oaslam/map/camera_replacement.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {

RelocalizationResult ResultOf(const Relocalization& found) {
  RelocalizationResult result;
  result.evidence = found.evidence;
  if (found.evidence != PoseEvidence::kNone) result.world_from_cam = found.cam_from_world.Inverse();
  result.confidence = found.confidence;
  result.object_score = found.object_score;
  result.object_margin = found.object_margin;
  result.inlier_points = found.inliers;
  result.matched_objects = found.matched_objects;
  result.sigma_position = found.sigma_position;
  for (const PoseHypothesis& h : found.candidates)
    result.candidates.push_back({h.cam_from_world.Inverse(), h.score});
  result.candidates_are_by = found.candidates_are_by;
  result.why_not = found.why_not;
  return result;
}

RelocalizationResult FindWithUnknownCamera(const ImageInput& input, const Camera& camera,
                                           const Map& given, RelocalizationMode mode,
                                           const SlamConfig& config, FrameMaker& maker,
                                           Relocalizer& relocalizer) {
  const Stopwatch watch;
  Camera plain = camera;
  plain.model = LensModel::kPinhole;
  plain.distortion = {};
  Map map = given;
  map.cameras.push_back(plain);
  Frame frame = maker.Make(input, 0, config.features.count, map.classes);
  frame.camera = static_cast<int>(map.cameras.size()) - 1;
  frame.features = std::make_shared<const Features>(WithCamera(*frame.features, camera, plain));
  frame.detections = IdealDetections(plain, input.detections);
  const double ms_features = watch.WallMs();
  Rng rng(static_cast<uint64_t>(config.runner.seed));
  const UnknownCameraRelocalization answer =
      relocalizer.FindWithUnknownCamera(frame, map, mode, input.gravity_in_cam, rng);
  RelocalizationResult result = ResultOf(answer.found);
  if (result.world_from_cam) {
    result.camera = answer.camera;
    result.focal_sigma_px = answer.relative_sigma * answer.camera.fx;
  }
  result.ms_features = ms_features;
  result.ms = watch.WallMs() - ms_features;
  return result;
}

RelocalizationResult Localizer::Find(const ImageInput& input, const Camera& camera,
                                     RelocalizationMode mode,
                                     const std::optional<Rigid3>& prior) const {
  CheckMode(mode);
  CheckCamera(camera);
  CheckGravity(input.gravity_in_cam);
  CheckPose(prior);
  const Stopwatch watch;
  Map map = map_.saved->map;  // shares its tables
  map.cameras.push_back(camera);
  Frame frame;
  if (input.image.empty()) {
    frame.detections = CheckedDetections(camera, input.detections);
    mode = RelocalizationMode::kObjects;
  } else {
    frame = FrameMaker(config_, camera).Make(input, 0, config_.features.count, map.classes);
  }
  frame.camera = static_cast<int>(map.cameras.size()) - 1;
  const double ms_features = watch.WallMs();
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const Relocalization found =
      Relocalizer(config_, map_.index)
          .Find(frame, map, mode, input.gravity_in_cam, rng, nullptr, prior);
  RelocalizationResult result = ResultOf(found);
  result.ms_features = ms_features;
  result.ms = watch.WallMs() - ms_features;
  return result;
}

RelocalizationResult Localizer::FindWithUnknownCamera(const ImageInput& input,
                                                      RelocalizationMode mode) const {
  CheckMode(mode);
  CheckGravity(input.gravity_in_cam);
  Camera camera;  // only its size is used
  camera.width = input.image.cols;
  camera.height = input.image.rows;
  camera.fx = camera.fy = std::max(camera.width, camera.height);
  camera.cx = (camera.width - 1) / 2.0;
  camera.cy = (camera.height - 1) / 2.0;
  CheckCamera(camera);
  FrameMaker maker(config_, camera);
  Relocalizer relocalizer(config_, map_.index);
  return oaslam::FindWithUnknownCamera(input, camera, map_.saved->map, mode, config_, maker,
                                       relocalizer);
}

}  // namespace oaslam
