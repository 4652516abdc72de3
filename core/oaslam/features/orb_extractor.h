#pragma once

#include <vector>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/features/features.h"
#include "oaslam/features/grey_image.h"
#include "oaslam/features/image_mask.h"
#include "oaslam/features/orb_kernels.h"
#include "oaslam/geometry/ideal_image.h"

namespace oaslam {

// ORB key points (Rublee et al. 2011) over an image pyramid, evenly spread over each level, and
// converted to the ideal image of the camera.
class OrbExtractor {
 public:
  OrbExtractor(const FeaturesConfig& config, const Camera& camera);

  // `image` has the camera's size. `count`: about how many key points. Not const, since buffers are
  // reused.
  Features Extract(const GreyImage& image, int count);
  // From now on takes images of another camera of the same size (PyramidScales::zoom).
  void UseCamera(const Camera& camera, double zoom);
  // From now on drops key points whose patch reaches into what the mask hides.
  void SetMask(const ImageMask& mask) { mask_ = mask; }
  // A copy of `image`, which must be the one that Extract processed last, at the resolution of the
  // lowest level.
  GreyBuffer WorkingImage(const GreyImage& image) const;
  // Features without key points, with the pyramid and bounds of this extractor.
  Features Nothing() const;

 private:
  std::vector<int> CountPerLevel(int count) const;
  std::vector<Corner> DetectCorners(const GreyImage& image);

  FeaturesConfig config_;
  Camera camera_;
  PyramidScales pyramid_;
  IdealImage ideal_image_;
  ImageMask mask_;
  std::vector<GreyBuffer> levels_;  // those that are large enough for key points
  GreyBuffer blurred_;
  std::vector<uint8_t> scores_;
};

}  // namespace oaslam
