#include "oaslam/relocalization/given_input.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/relocalization/frame_maker.h"
#include "oaslam/util/bad_input.h"

namespace oaslam {

void CheckFeatures(const ImageFeatures& given) {
  constexpr double kMostPixel = 1000;
  if (given.features.size() > Features::kMaxKeypoints)
    throw BadInput("features: {}, allowed: at most {}", given.features.size(),
                   Features::kMaxKeypoints);
  if (given.levels < 1 || given.levels > PyramidScales::kMaxLevels)
    throw BadInput("features: levels: {}, allowed: 1 to {}", given.levels,
                   PyramidScales::kMaxLevels);
  if (!(given.factor > 1 && given.factor <= 4))
    throw BadInput("features: factor: {}, allowed: above 1, at most 4", given.factor);
  if (!(given.lowest_pixel >= 0.1 && given.lowest_pixel <= kMostPixel))
    throw BadInput("features: lowest pixel: {}, allowed: .1 to {}", given.lowest_pixel, kMostPixel);
  for (size_t i = 0; i < given.features.size(); ++i) {
    const ImageFeature& f = given.features[i];
    if (!f.pixel.allFinite()) throw BadInput("feature {}: pixel: must be finite", i);
    if (!(f.angle_rad >= 0 && f.angle_rad <= 2 * std::numbers::pi_v<float>))
      throw BadInput("feature {}: angle: {}, allowed: 0 to 2 pi", i, f.angle_rad);
    if (f.level >= given.levels)
      throw BadInput("feature {}: level: {}, allowed: less than {}", i, f.level, given.levels);
  }
}

void CheckMotion(const MotionInput& given) {
  if (!given.is_known) return;
  if (given.run < 0) throw BadInput("motion: run: {}, allowed: at least 0", given.run);
  CheckPose(given.odom_from_cam);
  if (!(given.agreeing >= 0 && given.agreeing <= 1))
    throw BadInput("motion: agreeing: {}, allowed: 0 to 1", given.agreeing);
  for (size_t i = 0; i < given.depths.size(); ++i) {
    const auto& [pixel, inverse_depth] = given.depths[i];
    if (!pixel.allFinite() || !std::isfinite(inverse_depth))
      throw BadInput("motion: depth {}: must be finite", i);
  }
  for (size_t i = 0; i < given.corrected.size(); ++i) {
    CheckPose(given.corrected[i].odom_from_cam);
    if (i > 0 && given.corrected[i].image <= given.corrected[i - 1].image)
      throw BadInput("motion: corrected image {} does not come after {}", given.corrected[i].image,
                     given.corrected[i - 1].image);
  }
}

Features FeaturesOf(const ImageFeatures& given, const Box& bounds) {
  Features features;
  features.pyramid = PyramidScales(given.levels, given.factor, given.lowest_pixel);
  features.bounds = bounds;
  for (const ImageFeature& f : given.features) {
    features.keypoints.push_back({f.pixel, f.angle_rad, f.level});
    features.descriptors.push_back(f.descriptor);
  }
  features.BuildGrid();
  return features;
}

std::shared_ptr<const FrameMotion> MotionOf(const MotionInput& given, const Camera& camera) {
  if (!given.is_known) return nullptr;
  auto motion = std::make_shared<FrameMotion>();
  motion->run = -1 - given.run;
  motion->image = given.image;
  motion->cam_from_odom = given.odom_from_cam.Inverse();
  motion->is_preliminary = given.is_preliminary;
  motion->agreeing = given.agreeing;
  motion->is_keyframe = given.is_keyframe;
  for (const auto& [image, odom_from_cam] : given.corrected)
    motion->keyframes.emplace_back(image, odom_from_cam.Inverse());
  for (const auto& [pixel, inverse_depth] : given.depths)
    if (inverse_depth > 0)  // noise may place a point that is far away beyond infinity
      motion->depths.push_back(
          {Undistort(camera, pixel).cast<float>(), static_cast<float>(inverse_depth)});
  return motion;
}

}  // namespace oaslam
