#include "oaslam/pictures/svg.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace oaslam {
namespace {

constexpr const char* kFont = "Helvetica, Arial, 'DejaVu Sans', sans-serif";

std::string Escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20) result += c;  // XML allows no control characters
    }
  }
  return result;
}

std::string Join(const Points2& points) {
  std::string text;
  for (const auto& p : points)
    fmt::format_to(std::back_inserter(text), "{}{:.2f},{:.2f}", text.empty() ? "" : " ", p.x(),
                   p.y());
  return text;
}

}  // namespace

void SvgCanvas::Rectangle(const Eigen::Vector2d& corner, const Eigen::Vector2d& size,
                          const std::string& style) {
  body_ += fmt::format("<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" {}/>\n",
                       corner.x(), corner.y(), size.x(), size.y(), style);
}

void SvgCanvas::Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const std::string& style) {
  body_ += fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" {}/>\n",
                       a.x(), a.y(), b.x(), b.y(), style);
}

void SvgCanvas::Polyline(const Points2& points, const std::string& style) {
  body_ += fmt::format("<polyline points=\"{}\" fill=\"none\" {}/>\n", Join(points), style);
}

void SvgCanvas::Polygon(const Points2& points, const std::string& style) {
  body_ += fmt::format("<polygon points=\"{}\" {}/>\n", Join(points), style);
}

void SvgCanvas::Circle(const Eigen::Vector2d& center, double radius, const std::string& style) {
  body_ += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" {}/>\n", center.x(),
                       center.y(), radius, style);
}

void SvgCanvas::Ellipse(const Eigen::Vector2d& center, const Eigen::Vector2d& radii,
                        double angle_deg, const std::string& style) {
  body_ += fmt::format(
      "<ellipse rx=\"{:.2f}\" ry=\"{:.2f}\" transform=\"translate({:.2f} {:.2f}) rotate({:.2f})\" "
      "{}/>\n",
      radii.x(), radii.y(), center.x(), center.y(), angle_deg, style);
}

void SvgCanvas::Dots(const Points2& points, double diameter, const std::string& color) {
  body_ += "<path d=\"";
  for (const auto& p : points)
    fmt::format_to(std::back_inserter(body_), "M{:.1f} {:.1f}h0", p.x(), p.y());
  body_ += fmt::format(
      "\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2f}\" stroke-linecap=\"round\"/>\n", color,
      diameter);
}

void SvgCanvas::Text(const Eigen::Vector2d& baseline, const std::string& text, double size_px,
                     const std::string& anchor, const std::string& style) {
  body_ += fmt::format(
      "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:.1f}\" text-anchor=\"{}\" {}>{}</text>\n",
      baseline.x(), baseline.y(), size_px, anchor, style, Escaped(text));
}

void SvgCanvas::BeginClip(const Eigen::Vector2d& corner, const Eigen::Vector2d& size) {
  body_ += fmt::format(
      "<clipPath id=\"clip{}\"><rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" "
      "height=\"{:.2f}\"/></clipPath>\n<g clip-path=\"url(#clip{})\">\n",
      clips_, corner.x(), corner.y(), size.x(), size.y(), clips_);
  ++clips_;
}

void SvgCanvas::EndClip() { body_ += "</g>\n"; }

std::string SvgCanvas::Finish() const {
  return fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 "
      "0 {0:.0f} {1:.0f}\" font-family=\"{2}\">\n"
      "<rect width=\"{0:.0f}\" height=\"{1:.0f}\" fill=\"white\"/>\n{3}</svg>\n",
      width_, height_, kFont, body_);
}

double TextWidth(std::string_view text, double size_px) {
  return 0.56 * size_px * static_cast<double>(text.size());
}

double RoundStep(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double step : {5.0, 2.0})
    if (step * power <= value) return step * power;
  return power;
}

std::string HexOf(const Rgb& color) {
  return fmt::format("#{:02x}{:02x}{:02x}", color[0], color[1], color[2]);
}

}  // namespace oaslam
