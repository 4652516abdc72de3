#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "oaslam/camera.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// A software rasteriser of triangles in an ideal image, with 2 x 2 samples a
// pixel and a depth buffer.
class Raster {
 public:
  struct Vertex {
    Eigen::Vector3d in_cam;
    Eigen::Vector3f color;  // linear RGB, after lighting
  };

  // `area`: the part of the picture to draw, in pixels; `near`: the least depth that is drawn,
  // above 0.
  Raster(const Camera& camera, const cv::Rect& area, double near);

  // Draws a triangle; both of its sides are visible.
  void Draw(const std::array<Vertex, 3>& triangle);
  // Removes samples behind an ellipsoid that is completely in front of the camera.
  void HideBehind(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world);
  // Blends the samples into a picture of the camera, 8-bit BGR.
  void BlendInto(cv::Mat& picture) const;

 private:
  struct Sample {
    float inverse_depth = 0;  // 0: empty
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
  // `ray`: as given by RayOf. Returns 0 where the ray misses.
  double DepthAlong(const Eigen::Vector3d& ray) const;

 private:
  Eigen::Matrix3d unit_from_cam_;  // to the frame in which the ellipsoid is a unit sphere
  Eigen::Vector3d center_;
};

}  // namespace oaslam
