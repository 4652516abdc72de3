#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/depth_image.h"
#include "oaslam/features/depth_map.h"

namespace oaslam {

// Throws InputError for a depth that does not belong to an image of `camera`: of another type, with
// a unit, a range or a calibration that is not valid, or registered but of another shape.
void CheckDepth(const DepthImage& depth, const Camera& camera);

// Makes the images of a depth camera into depths as the image of the colour camera shows them.
// Warns, once, where hardly any depth is in the range of the depth camera, as with a wrong unit.
class DepthRegistration {
 public:
  // Throws as CheckDepth.
  std::shared_ptr<const DepthMap> Register(const DepthImage& depth, const Camera& camera);

 private:
  std::shared_ptr<const DepthMap> Splat(const DepthImage& depth, const Camera& camera);
  void UseCameras(const DepthImage& depth, const Camera& camera);
  void CheckRange(const DepthImage& depth);

  Camera depth_camera_, camera_;  // of the last image that was not registered
  Rigid3::Rotation rotation_ = Rigid3::Rotation::Identity();  // as of cam_from_depth
  float most_tangent_ = 0;  // of an angle that the colour camera sees
  // Of its pixels that are used, row by row, along the axes of the colour camera, for a depth of 1;
  // not finite where the lens shows nothing.
  std::vector<Eigen::Vector3f> rays_;
  int strange_images_ = 0;  // in a row, with hardly any depth in the range
};

}  // namespace oaslam
