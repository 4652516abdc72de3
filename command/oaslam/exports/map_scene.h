#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "oaslam/storage/map_file.h"
#include "oaslam/trajectory_file.h"

namespace oaslam {

// The elements of pictures and models of a map.

using Rgb = std::array<unsigned char, 3>;
constexpr Rgb kLandmarkColor = {150, 154, 160}, kTrajectoryColor = {27, 127, 168},
              kKeyframeColor = {224, 142, 27};

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
// The same as lines without gaps.
std::vector<std::vector<StampedPose>> TrajectoryLines(const SavedMap& saved);

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
