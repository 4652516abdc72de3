#include "oaslam/content/raster.h"

#include <algorithm>
#include <cmath>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/util/srgb.h"

namespace oaslam {
namespace {

// Lookup tables of the sRGB transfer function.
struct Curves {
  static constexpr int kSteps = 4096;  // so that dark values are right, where the curve is steep
  std::array<float, 256> to_linear;
  std::array<unsigned char, kSteps + 1> to_srgb;

  Curves() {
    for (int i = 0; i < 256; ++i) to_linear[i] = LinearFromSrgb(static_cast<float>(i) / 255);
    for (int i = 0; i <= kSteps; ++i)
      to_srgb[i] = static_cast<unsigned char>(
          std::lround(255 * SrgbFromLinear(static_cast<float>(i) / kSteps)));
  }
  unsigned char ToSrgb(float linear) const {
    // The comparison maps NaN to 0.
    const float within = linear > 0 ? std::min(linear, 1.0F) : 0.0F;
    return to_srgb[static_cast<int>(within * kSteps + 0.5F)];
  }
};

Raster::Vertex Between(const Raster::Vertex& a, const Raster::Vertex& b, double near) {
  const double share = (near - a.in_cam.z()) / (b.in_cam.z() - a.in_cam.z());
  return {a.in_cam + share * (b.in_cam - a.in_cam),
          a.color + static_cast<float>(share) * (b.color - a.color)};
}

}  // namespace

EllipsoidFront::EllipsoidFront(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world)
    : unit_from_cam_(ellipsoid.half_axes.cwiseInverse().asDiagonal() *
                     (cam_from_world.rotation * ellipsoid.rotation).conjugate().toRotationMatrix()),
      center_(unit_from_cam_ * (cam_from_world * ellipsoid.center)) {}

double EllipsoidFront::DepthAlong(const Eigen::Vector3d& ray) const {
  // |depth * d - center| = 1
  const Eigen::Vector3d d = unit_from_cam_ * ray;
  const double a = d.squaredNorm(), b = d.dot(center_),
               discriminant = b * b - a * (center_.squaredNorm() - 1);
  return discriminant < 0 ? 0 : std::max(0.0, (b - std::sqrt(discriminant)) / a);
}

Raster::Raster(const Camera& camera, const cv::Rect& area, double near)
    : camera_(camera),
      area_(area),
      near_(near),
      width_(2 * area.width),
      height_(2 * area.height),
      samples_(static_cast<size_t>(width_) * static_cast<size_t>(height_)) {}

cv::Rect Raster::SamplesIn(double left, double top, double right, double bottom) const {
  const auto first = [](double pixel, int origin, int end) {
    return static_cast<int>(
        std::clamp(std::ceil(2 * (pixel - origin + 0.25)), 0.0, static_cast<double>(end)));
  };
  const auto end = [](double pixel, int origin, int count) {
    return static_cast<int>(
        std::clamp(std::floor(2 * (pixel - origin + 0.25)) + 1, 0.0, static_cast<double>(count)));
  };
  const int x1 = first(left, area_.x, width_), x2 = end(right, area_.x, width_);
  const int y1 = first(top, area_.y, height_), y2 = end(bottom, area_.y, height_);
  return {x1, y1, std::max(x2 - x1, 0), std::max(y2 - y1, 0)};
}

void Raster::Draw(const std::array<Vertex, 3>& triangle) {
  std::array<Vertex, 4> clipped;
  size_t count = 0;
  for (size_t i = 0; i < 3; ++i) {
    const Vertex &a = triangle[i], &b = triangle[(i + 1) % 3];
    const bool a_in = a.in_cam.z() >= near_, b_in = b.in_cam.z() >= near_;
    if (a_in) clipped[count++] = a;
    if (a_in != b_in) clipped[count++] = Between(a, b, near_);
  }
  for (size_t i = 2; i < count; ++i) DrawClipped(clipped[0], clipped[i - 1], clipped[i]);
}

void Raster::DrawClipped(const Vertex& a, const Vertex& b, const Vertex& c) {
  const Eigen::Vector2d pa = ProjectIdeal(camera_, a.in_cam), pb = ProjectIdeal(camera_, b.in_cam),
                        pc = ProjectIdeal(camera_, c.in_cam);
  const Eigen::Vector2d ab = pb - pa, ac = pc - pa;
  const double area = ab.x() * ac.y() - ab.y() * ac.x();
  if (!(std::abs(area) > 1e-9) || !std::isfinite(area)) return;
  const cv::Rect box =
      SamplesIn(std::min({pa.x(), pb.x(), pc.x()}), std::min({pa.y(), pb.y(), pc.y()}),
                std::max({pa.x(), pb.x(), pc.x()}), std::max({pa.y(), pb.y(), pc.y()}));
  const double inverse_area = 1 / area;
  const double za = 1 / a.in_cam.z(), zb = 1 / b.in_cam.z(), zc = 1 / c.in_cam.z();
  for (int y = box.y; y < box.br().y; ++y) {
    const double dy = PixelY(y) - pa.y();
    for (int x = box.x; x < box.br().x; ++x) {
      const double dx = PixelX(x) - pa.x();
      // Barycentric coordinates in the image; divided by depth they give those in space.
      const double share_b = (dx * ac.y() - dy * ac.x()) * inverse_area;
      const double share_c = (ab.x() * dy - ab.y() * dx) * inverse_area;
      const double share_a = 1 - share_b - share_c;
      if (!(share_a >= 0 && share_b >= 0 && share_c >= 0)) continue;
      const double wa = share_a * za, wb = share_b * zb, wc = share_c * zc,
                   inverse_depth = wa + wb + wc;
      Sample& sample =
          samples_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
      if (inverse_depth <= sample.inverse_depth) continue;
      const double depth = 1 / inverse_depth;
      sample.inverse_depth = static_cast<float>(inverse_depth);
      sample.color = static_cast<float>(wa * depth) * a.color +
                     static_cast<float>(wb * depth) * b.color +
                     static_cast<float>(wc * depth) * c.color;
    }
  }
}

void Raster::HideBehind(const Ellipsoid& ellipsoid, const Rigid3& cam_from_world) {
  const std::optional<Box> outline = ProjectToBox(ellipsoid, cam_from_world, camera_);
  if (!outline) return;
  const cv::Rect box =
      SamplesIn(outline->x1 - 0.5, outline->y1 - 0.5, outline->x2 - 0.5, outline->y2 - 0.5);
  const EllipsoidFront front(ellipsoid, cam_from_world);
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x) {
      Sample& sample =
          samples_[static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x)];
      if (sample.inverse_depth <= 0) continue;
      const double depth = front.DepthAlong(RayOf(camera_, {PixelX(x), PixelY(y)}));
      if (depth > 0 && depth * sample.inverse_depth < 1) sample.inverse_depth = 0;
    }
}

void Raster::BlendInto(cv::Mat& picture) const {
  static const Curves curves;
  for (int y = 0; y < area_.height; ++y) {
    auto* pixels = picture.ptr<cv::Vec3b>(area_.y + y) + area_.x;
    for (int x = 0; x < area_.width; ++x) {
      const size_t first =
          static_cast<size_t>(2 * y) * static_cast<size_t>(width_) + static_cast<size_t>(2 * x);
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      int covered = 0;
      const size_t below = first + static_cast<size_t>(width_);
      for (const size_t i : {first, first + 1, below, below + 1}) {
        if (samples_[i].inverse_depth <= 0) continue;
        sum += samples_[i].color;
        ++covered;
      }
      if (covered == 0) continue;
      cv::Vec3b& pixel = pixels[x];
      for (int channel = 0; channel < 3; ++channel) {
        const float behind = curves.to_linear[pixel[channel]] * static_cast<float>(4 - covered);
        pixel[channel] = curves.ToSrgb((sum[2 - channel] + behind) / 4);
      }
    }
  }
}

}  // namespace oaslam
