#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "oaslam/exports/map_scene.h"

namespace oaslam {

using Points2 = std::vector<Eigen::Vector2d>;

// A drawing in SVG, in pixels, y down; later shapes lie on top. `style` is a list of SVG
// attributes, e.g. fill="none".
class SvgCanvas {
 public:
  SvgCanvas(double width, double height) : width_(width), height_(height) {}

  void Rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size,
                 const std::string& style);
  void Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const std::string& style);
  void Polyline(const Points2& points, const std::string& style);
  void Polygon(const Points2& points, const std::string& style);
  void Circle(const Eigen::Vector2d& center, double radius, const std::string& style);
  void Ellipse(const Eigen::Vector2d& center, const Eigen::Vector2d& radii, double angle_deg,
               const std::string& style);
  // Draws all dots as one element, since there may be thousands.
  void Dots(const Points2& points, double diameter, const std::string& color);
  // `anchor`: start, middle or end.
  void Text(const Eigen::Vector2d& baseline, const std::string& text, double size_px,
            const std::string& anchor = "start", const std::string& style = R"(fill="#333")");
  // Shapes up to EndClip are clipped to this rectangle.
  void BeginClip(const Eigen::Vector2d& corner, const Eigen::Vector2d& size);
  void EndClip();

  std::string Finish() const;

 private:
  double width_, height_;
  int clips_ = 0;
  std::string body_;
};

// The approximate width of a text, in pixels.
double TextWidth(std::string_view text, double size_px);

// The largest of 1, 2, 5 times a power of ten that is at most `value` (above 0).
double RoundStep(double value);

// "#2a9d8f", as attributes of SVG want it.
std::string HexOf(const Rgb& color);

}  // namespace oaslam
