#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "oaslam/camera.h"
#include "oaslam/types.h"

namespace oaslam {

// Everything after feature extraction works in the ideal pinhole image of a camera: the same focal
// lengths and principal point, no distortion. Points and boxes are converted to it once, exactly,
// by these functions.

// Converts a pixel of the original image to the ideal pinhole image (which is unbounded). Where the
// lens model has no inverse (IdealImage::Undistort tells where), the result is finite but has no
// meaning.
Eigen::Vector2d Undistort(const Camera& camera, const Eigen::Vector2d& pixel);
// Undistort for many pixels of one camera, which is faster: `max_lens_angle` is the result of
// MaxLensAngle.
Eigen::Vector2d Undistort(const Camera& camera, double max_lens_angle,
                          const Eigen::Vector2d& pixel);

// The angle from the optical axis, in rad, up to which the lens model is one to one (its radius
// increases) and a point has an image in a pinhole camera.
double MaxLensAngle(const Camera& camera);

// The inverse of Undistort.
Eigen::Vector2d Distort(const Camera& camera, const Eigen::Vector2d& ideal);

// Converts a box of the original image to the ideal one: each edge is moved with its midpoint, near
// which the outline of most objects touches it. Boxes are areas, so an edge at x lies at pixel
// coordinate x - 0.5; this holds before and after.
Box UndistortBox(const Camera& camera, const Box& box);

// The bounding box of all pixels of the camera in the ideal image.
Box IdealImageBounds(const Camera& camera);

// The camera of the same images scaled to another size. Pixel centres are at integers.
Camera Scaled(const Camera& camera, int width, int height);

// The camera with `ratio` times its focal length, as after a zoom; the same distortion of rays.
Camera Zoomed(const Camera& camera, double ratio);
// The ratio of the focal lengths of two cameras that differ in nothing else, as those of a lens
// that zooms; nothing for others, and for guesses.
std::optional<double> ZoomBetween(const Camera& from, const Camera& to);

// The size of a detector pixel in px of the camera's image. Detectors scale images so that the
// longer side has a fixed length, and the errors of their boxes scale with it: they are given in
// detector pixels, those of an image of 640 px.
inline double DetectorPixel(const Camera& camera) {
  return std::max(camera.width, camera.height) / 640.0;
}

// Edges of a box within 3 detector pixels of the border of the original image: bits of
// kLeft..kBottom.
enum EdgeBit : unsigned char { kLeft = 1, kTop = 2, kRight = 4, kBottom = 8 };
unsigned char TruncatedEdges(const Camera& camera, const Box& box);

// A point of less depth is taken as at the camera or behind it. This only prevents a division by
// zero, since the unit of the world is arbitrary.
inline constexpr double kMinDepth = 1e-6;

// Ideal pinhole projection; z must not be zero.
inline Eigen::Vector2d ProjectIdeal(const Camera& camera, const Eigen::Vector3d& x_in_cam) {
  const double inverse_z = 1.0 / x_in_cam.z();
  return {camera.fx * x_in_cam.x() * inverse_z + camera.cx,
          camera.fy * x_in_cam.y() * inverse_z + camera.cy};
}

// The ray (z = 1) through a point of the ideal image.
inline Eigen::Vector3d RayOf(const Camera& camera, const Eigen::Vector2d& ideal) {
  return {(ideal.x() - camera.cx) / camera.fx, (ideal.y() - camera.cy) / camera.fy, 1.0};
}

}  // namespace oaslam
