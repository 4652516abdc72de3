#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// The elements of pictures and models of a map.

using Rgb = std::array<unsigned char, 3>;
constexpr Rgb kLandmarkColor = {150, 154, 160}, kTrajectoryColor = {27, 127, 168},
              kKeyframeColor = {224, 142, 27};

// A palette of colours that are easy to distinguish; it repeats.
Rgb PaletteColor(size_t index);

struct ExportedObject {
  ObjectId id;
  const Object* object = nullptr;
  std::string label;  // its own name, else that of its class
  Rgb color{};        // of its class
};

// The mapped objects, ascending by id.
std::vector<ExportedObject> ExportedObjects(const SavedMap& saved);

// Final poses of the frames of each recording, by time; those of the keyframes where it has no
// trajectory.
std::vector<std::vector<StampedPose>> FinalTrajectories(const SavedMap& saved);
// Splits a trajectory at gaps in time and where time goes back (the next run).
std::vector<std::vector<StampedPose>> SplitAtGaps(const std::vector<StampedPose>& poses);
// The final trajectories, split likewise.
std::vector<std::vector<StampedPose>> TrajectoryLines(const SavedMap& saved);

// The axes of a view of the ground plane from above: `right` and `forward` span the plane, `up`
// points at the viewer.
struct TopAxes {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX(), forward = Eigen::Vector3d::UnitZ(),
                  up = -Eigen::Vector3d::UnitY();

  Eigen::Vector2d operator()(const Eigen::Vector3d& x) const {
    return {right.dot(x), forward.dot(x)};
  }
};

// `up` if given, else the mean up of the cameras; the first camera looks
// towards the top of the page.
TopAxes FindTopAxes(const std::vector<Rigid3>& world_from_cams,
                    const std::optional<Eigen::Vector3d>& up);

// Rotations from the map's frame to one with y or z up.
Eigen::Matrix3d YUpFromWorld(const Map& map);
Eigen::Matrix3d ZUpFromWorld(const Map& map);

struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside
};

// A mesh of the unit sphere made of meridians and parallels.
TriangleMesh UnitSphere();

// Apex and corners (top left, top right, bottom right, bottom left) of a camera's view frustum up
// to `depth`, OpenCV axes.
std::array<Eigen::Vector3d, 5> FrustumCorners(const Camera& camera, double depth);
// The edges of the frustum, as pairs of corners.
inline constexpr std::array<std::array<uint32_t, 2>, 8> kFrustumEdges = {
    {{0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 2}, {2, 3}, {3, 4}, {4, 1}}};
// The depth of drawn frusta: a share of the median depth of the landmarks, or of the length of the
// camera's path.
double FrustumDepth(const Map& map);

}  // namespace oaslam
