#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// Triangles in an ideal image, drawn by the processor: 2 x 2 samples a pixel, each with the depth
// of what is nearest.
class Raster {
 public:
  struct Vertex {
    Eigen::Vector3d in_cam;
    Eigen::Vector3f color;  // linear RGB, lit
  };

  // `area`: of the picture, in pixels; `near`: depth before which nothing is drawn, above 0.
  Raster(const Camera& camera, const cv::Rect& area, double near);

  // Both sides are seen.
  void Draw(const std::array<Vertex, 3>& triangle);
  // Takes away what lies behind the front of an ellipsoid that is wholly in front of the camera.
  void HideBehind(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world);
  // Lays the samples over a picture of the camera, 8-bit BGR.
  void BlendInto(cv::Mat& picture) const;

 private:
  struct Sample {
    float inverse_depth = 0;  // 0: nothing is there
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
  };

  void DrawClipped(const Vertex& a, const Vertex& b, const Vertex& c);
  // The samples in a box of the ideal image (pixels, not the box convention).
  cv::Rect SamplesIn(double left, double top, double right, double bottom) const;
  double PixelX(int sample) const { return area_.x + 0.5 * sample - 0.25; }
  double PixelY(int sample) const { return area_.y + 0.5 * sample - 0.25; }

  Camera camera_;
  cv::Rect area_;
  double near_;
  int width_, height_;  // in samples
  std::vector<Sample> samples_;
};

// The depth at which the ray of a pixel meets the front of an ellipsoid.
class EllipsoidFront {
 public:
  EllipsoidFront(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world);
  // `ray` as of RayOf; 0 where the ray misses.
  double DepthAlong(const Eigen::Vector3d& ray) const;

 private:
  Eigen::Matrix3d unit_from_cam_;  // to where the ellipsoid is a unit sphere
  Eigen::Vector3d center_;
};

}  // namespace oaslam
