#include "oaslam/objects/box_depth.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/metre.h"
#include "oaslam/util/median.h"

namespace oaslam {

std::optional<double> UnitsPerMetre(const TrackedFrame& tracked, const Map& map) {
  constexpr size_t kLeast = 15;
  const Frame& frame = tracked.frame;
  if (!frame.depth) return std::nullopt;
  std::vector<double> units;
  for (size_t i = 0; i < tracked.landmarks.size(); ++i) {
    const Landmark* landmark = map.landmarks.Find(tracked.landmarks[i]);
    if (!landmark) continue;
    const double z = (tracked.cam_from_world * landmark->position).z();
    const auto measured =
        frame.depth->At(Distort(*frame.camera, frame.features->keypoints[i].px.cast<double>()));
    if (measured && z > 0) units.push_back(z / measured->z);
  }
  if (units.size() < kLeast) return std::nullopt;
  return Median(std::move(units));
}

std::optional<double> SurfaceIn(const Box& box, const Camera& camera, const DepthMap& depth) {
  constexpr int kSteps = 16;           // in each direction
  constexpr double kInner = 0.6;       // of the sides: what is nearer to the edges may be behind
  constexpr double kThickness = 0.15;  // of a surface, a share of its depth
  constexpr double kMuch = 0.35;       // of the inner box
  constexpr size_t kLeast = 40;        // measured, of the steps
  std::vector<double> found;
  const Eigen::Vector2d center = CenterPixel(box);
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const Eigen::Vector2d share((j + 0.5) / kSteps - 0.5, (i + 0.5) / kSteps - 0.5);
      const Eigen::Vector2d px =
          center + kInner * share.cwiseProduct(Eigen::Vector2d(box.Width(), box.Height()));
      const Eigen::Vector2d at = depth.InMap(Distort(camera, px));
      const auto x = static_cast<int>(std::lround(at.x())),
                 y = static_cast<int>(std::lround(at.y()));
      if (x < 0 || y < 0 || x >= depth.width() || y >= depth.height()) continue;
      if (const double z = depth.z(x, y); z > 0) found.push_back(z);
    }
  if (found.size() < kLeast) return std::nullopt;
  std::ranges::sort(found);
  const auto needed = static_cast<size_t>(kMuch * static_cast<double>(found.size()));
  for (size_t first = 0; first + needed <= found.size(); ++first) {
    const auto end = std::ranges::upper_bound(found, found[first] * (1 + kThickness));
    const auto count = static_cast<size_t>(end - found.begin()) - first;
    if (count >= needed) return found[first + count / 2];
  }
  return std::nullopt;
}

std::vector<ObjectDetection> WithSurfaces(const Frame& frame, const Map& map) {
  std::vector<ObjectDetection> detections = frame.detections;
  if (!frame.depth || !SigmaOfMetre(map)) return detections;
  for (ObjectDetection& d : detections)
    d.surface = SurfaceIn(d.box, *frame.camera, *frame.depth).value_or(0);
  return detections;
}

}  // namespace oaslam
