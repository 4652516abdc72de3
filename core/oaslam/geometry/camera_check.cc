#include "oaslam/geometry/camera_check.h"

#include <fmt/format.h>

#include <algorithm>

namespace oaslam {
namespace {

// An empty text where the value is within its bounds.
std::string RangeProblem(const char* key, double value, double min, double max) {
  if (value >= min && value <= max) return "";
  return fmt::format("{}: {}, allowed: {:.6g} to {:.6g}", key, value, min, max);
}

std::string FocalLengthProblem(const char* key, double value, double longest) {
  // Of millimetres, and of a share of the width.
  constexpr double kMostMillimetres = 25;
  if (value > 0 && value < std::min(kMostMillimetres, 0.04 * longest))
    return fmt::format(
        "{}: {}, expected pixels; {}", key, value,
        value < 5 ? "a share of the image's width is to be multiplied by the width, millimetres by "
                    "width / width of the sensor"
                  : "millimetres are to be multiplied by width / width of the sensor");
  // Fields of view from 170 degrees down to about half a degree.
  return RangeProblem(key, value, 0.04 * longest, 100 * longest);
}

}  // namespace

std::string ProblemOf(const Camera& camera) {
  const double longest = std::max(camera.width, camera.height);
  // From a thumbnail to the largest panorama.
  std::string problem = RangeProblem("image width", camera.width, 16, 100000);
  if (problem.empty()) problem = RangeProblem("image height", camera.height, 16, 100000);
  if (problem.empty()) problem = FocalLengthProblem("focal length fx", camera.fx, longest);
  if (problem.empty()) problem = FocalLengthProblem("focal length fy", camera.fy, longest);
  if (problem.empty()) problem = RangeProblem("principal point cx", camera.cx, 0, camera.width);
  if (problem.empty()) problem = RangeProblem("principal point cy", camera.cy, 0, camera.height);
  // Those of narrow lenses are large, since they are of high powers of small radii.
  for (const double k : camera.distortion)
    if (problem.empty()) problem = RangeProblem("distortion coefficient", k, -100, 100);
  if (problem.empty())
    problem = RangeProblem("standard deviation of the focal length", camera.focal_sigma, 0, 10);
  return problem;
}

}  // namespace oaslam
