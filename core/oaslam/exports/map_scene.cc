#include "oaslam/exports/map_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

TopAxes AxesOf(const Map& map) {
  std::vector<Rigid3> poses;
  map.keyframes.ForEach(
      [&](KeyframeId, const Keyframe& k) { poses.push_back(k.cam_from_world.Inverse()); });
  return FindTopAxes(poses, map.up);
}

}  // namespace

Rgb PaletteColor(size_t index) {
  static constexpr auto kColors = std::to_array<Rgb>({{0xd1, 0x49, 0x5b},
                                                      {0x2a, 0x9d, 0x8f},
                                                      {0xe0, 0x8e, 0x1b},
                                                      {0x6a, 0x4c, 0x93},
                                                      {0x3a, 0x7d, 0x44},
                                                      {0xc2, 0x52, 0x9b},
                                                      {0x1b, 0x7f, 0xa8},
                                                      {0x8c, 0x5a, 0x2b},
                                                      {0x7a, 0x8b, 0x12},
                                                      {0xb0, 0x3a, 0x2e},
                                                      {0x4b, 0x6c, 0xb7},
                                                      {0x5f, 0x5f, 0x5f}});
  return kColors[index % kColors.size()];
}

std::vector<ExportedObject> ExportedObjects(const SavedMap& saved) {
  std::map<int, Rgb> colors;
  std::vector<ExportedObject> objects;
  saved.map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    colors[object.category_id];
    objects.push_back(
        {id,
         &object,
         object.name.empty() ? NameOf(saved.class_names, object.category_id) : object.name,
         {}});
  });
  size_t next = 0;
  for (auto& [category, color] : colors) color = PaletteColor(next++);
  for (ExportedObject& o : objects) o.color = colors.at(o.object->category_id);
  return objects;
}

std::vector<std::vector<StampedPose>> FinalTrajectories(const SavedMap& saved) {
  const size_t count = std::max<size_t>(1, saved.recordings.size());
  const auto of = [&](int frame) { return RecordingOf(saved.recordings, frame); };
  std::vector<std::vector<FramePose>> frames(count);
  for (const FramePose& frame : saved.trajectory) frames[of(frame.frame_index)].push_back(frame);
  std::vector<std::vector<StampedPose>> poses(count), keyframes(count);
  saved.map.keyframes.ForEach([&](KeyframeId, const Keyframe& k) {
    keyframes[of(k.frame_index)].push_back({k.timestamp, k.cam_from_world.Inverse()});
  });
  for (size_t i = 0; i < count; ++i) {
    poses[i] = WorldPoses(saved.map, frames[i]);
    if (poses[i].empty()) poses[i] = std::move(keyframes[i]);
    std::ranges::stable_sort(poses[i], {}, &StampedPose::timestamp);
  }
  return poses;
}

std::vector<std::vector<StampedPose>> SplitAtGaps(const std::vector<StampedPose>& poses) {
  if (poses.empty()) return {};
  std::vector<double> gaps;
  for (size_t i = 1; i < poses.size(); ++i)
    gaps.push_back(poses[i].timestamp - poses[i - 1].timestamp);
  std::ranges::sort(gaps);
  // Ten usual intervals, and half a second at least: less is missing images.
  const double longest = gaps.empty() ? 0 : std::max(10 * gaps[gaps.size() / 2], 0.5);
  std::vector<std::vector<StampedPose>> lines(1);
  for (size_t i = 0; i < poses.size(); ++i) {
    const double gap = i > 0 ? poses[i].timestamp - poses[i - 1].timestamp : 0;
    if (gap > longest || gap < 0) lines.emplace_back();
    lines.back().push_back(poses[i]);
  }
  return lines;
}

std::vector<std::vector<StampedPose>> TrajectoryLines(const SavedMap& saved) {
  std::vector<std::vector<StampedPose>> lines;
  for (const std::vector<StampedPose>& poses : FinalTrajectories(saved))
    for (std::vector<StampedPose>& line : SplitAtGaps(poses)) lines.push_back(std::move(line));
  return lines;
}

TopAxes FindTopAxes(const std::vector<Rigid3>& world_from_cams,
                    const std::optional<Eigen::Vector3d>& up) {
  TopAxes axes;
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  for (const Rigid3& pose : world_from_cams) mean_up += pose.rotation * -Eigen::Vector3d::UnitY();
  if (up)
    axes.up = up->normalized();
  else if (mean_up.norm() > 1e-6)
    axes.up = mean_up.normalized();
  Eigen::Vector3d right =
      world_from_cams.empty()
          ? Eigen::Vector3d::UnitX()
          : Eigen::Vector3d(world_from_cams[0].rotation * Eigen::Vector3d::UnitX());
  right -= right.dot(axes.up) * axes.up;
  if (right.norm() < 1e-3) right = axes.up.unitOrthogonal();
  axes.right = right.normalized();
  axes.forward = axes.up.cross(axes.right);
  return axes;
}

Eigen::Matrix3d YUpFromWorld(const Map& map) {
  const TopAxes axes = AxesOf(map);
  Eigen::Matrix3d rows;
  rows << axes.right.transpose(), axes.up.transpose(), -axes.forward.transpose();
  return rows;
}

Eigen::Matrix3d ZUpFromWorld(const Map& map) {
  const TopAxes axes = AxesOf(map);
  Eigen::Matrix3d rows;
  rows << axes.right.transpose(), axes.forward.transpose(), axes.up.transpose();
  return rows;
}

TriangleMesh UnitSphere() {
  // Parallels without the poles: faces of 15 degrees look round, and make 528 triangles an object.
  constexpr uint32_t kMeridians = 24, kParallels = 11;
  TriangleMesh mesh;
  mesh.vertices.push_back(Eigen::Vector3d::UnitZ());
  for (uint32_t i = 1; i <= kParallels; ++i)
    for (uint32_t j = 0; j < kMeridians; ++j) {
      const double polar = std::numbers::pi * i / (kParallels + 1),
                   azimuth = 2 * std::numbers::pi * j / kMeridians;
      mesh.vertices.emplace_back(std::sin(polar) * std::cos(azimuth),
                                 std::sin(polar) * std::sin(azimuth), std::cos(polar));
    }
  mesh.vertices.push_back(-Eigen::Vector3d::UnitZ());
  const auto at = [](uint32_t parallel, uint32_t meridian) {
    return 1 + parallel * kMeridians + meridian % kMeridians;
  };
  const auto south = static_cast<uint32_t>(mesh.vertices.size() - 1);
  for (uint32_t j = 0; j < kMeridians; ++j) {
    mesh.triangles.push_back({0, at(0, j), at(0, j + 1)});
    for (uint32_t i = 0; i + 1 < kParallels; ++i) {
      mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
    mesh.triangles.push_back({south, at(kParallels - 1, j + 1), at(kParallels - 1, j)});
  }
  return mesh;
}

std::array<Eigen::Vector3d, 5> FrustumCorners(const Camera& camera, double depth) {
  const double right = camera.width - 0.5, bottom = camera.height - 0.5;
  return {Eigen::Vector3d::Zero(), RayOf(camera, {-0.5, -0.5}) * depth,
          RayOf(camera, {right, -0.5}) * depth, RayOf(camera, {right, bottom}) * depth,
          RayOf(camera, {-0.5, bottom}) * depth};
}

double FrustumDepth(const Map& map) {
  std::vector<double> depths, distances;
  std::optional<Eigen::Vector3d> first;
  map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
    if (const double depth = map.MedianDepth(id); depth > 0) depths.push_back(depth);
    const Eigen::Vector3d center = k.cam_from_world.OriginInSource();
    if (!first) first = center;
    distances.push_back((center - *first).norm());
  });
  constexpr double kShare = 0.05;  // frusta are small against what the cameras see
  if (!depths.empty()) return kShare * Median(std::move(depths));
  const double way = distances.empty() ? 0 : Median(std::move(distances));
  return way > 0 ? kShare * way : kShare;
}

}  // namespace oaslam
