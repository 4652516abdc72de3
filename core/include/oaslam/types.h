#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/export.h"
#include "oaslam/rigid3.h"

namespace oaslam {

// An axis-aligned image box as an area: the box of the one pixel (5, 7) is [5, 7, 6, 8].
struct Box {
  double x1 = 0, y1 = 0, x2 = 0, y2 = 0;

  // Pixels; below 0 where the edges are swapped.
  double Width() const { return x2 - x1; }
  // Pixels; below 0 where the edges are swapped.
  double Height() const { return y2 - y1; }
  // Square pixels; 0 where the box is empty.
  double Area() const { return Width() > 0 && Height() > 0 ? Width() * Height() : 0; }
  // Pixels.
  Eigen::Vector2d Center() const { return {(x1 + x2) / 2, (y1 + y2) / 2}; }
  bool operator==(const Box&) const = default;
};

// A class that a detector assigns to a box, and its score.
struct Label {
  int category_id = 0;
  double score = 0;  // [0, 1]
  bool operator==(const Label&) const = default;
};

// A detection of an object detector in one image.
struct Detection {
  int category_id = 0;
  double score = 0;  // (0, 1]
  Box box;           // pixels of the original (distorted) image
  // An ellipse around the object, [cx, cy, width, height, theta], in pixels and rad, where the
  // detector gives one. Slam does not use it.
  std::optional<std::array<double, 5>> ellipse{};
  // Other classes that the box may show, each at most once, where the detector is not sure. Their
  // scores are at most that of the detection.
  std::vector<Label> other_labels{};
};

// {x : |diag(1/half_axes) * rotation^T * (x - center)| <= 1}; rotation is world_from_object.
struct Ellipsoid {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d half_axes = Eigen::Vector3d::Ones();
  Rigid3::Rotation rotation = Rigid3::Rotation::Identity();
};

// How the pose of an image was found. kInitializing: there is no map yet, and no pose; kTracking:
// by tracking from the previous image; kRelocalized: by a search in the map after the camera was
// lost; kObjects: the camera is lost, and the pose is by objects alone, or by dead reckoning from
// earlier images that were found in the map (PoseSource tells which); kLost: no pose was found;
// kOdometry: by dead reckoning since the map last gave a pose, so that the error grows;
// kPreliminary: before there is a map, by the motion that explains the first images best.
enum class TrackingState {
  kInitializing,
  kTracking,
  kRelocalized,
  kObjects,
  kLost,
  kOdometry,
  kPreliminary
};

// Whether the camera is lost: no landmarks give its pose, but objects may (kObjects).
constexpr bool IsLost(TrackingState state) {
  return state == TrackingState::kLost || state == TrackingState::kObjects;
}

// "initializing", "tracking", "relocalized", "objects", "lost", "odometry", "preliminary".
OASLAM_API const char* ToString(TrackingState state);

// The evidence that supports a pose.
enum class PoseEvidence { kNone, kPoints, kObjects, kPointsAndObjects };

// "failed", "points", "objects", "points+objects".
OASLAM_API const char* ToString(PoseEvidence evidence);

// Which evidence may be used to find a camera.
enum class RelocalizationMode { kPoints, kObjects, kPointsAndObjects };

// "points", "objects", "points+objects".
OASLAM_API const char* ToString(RelocalizationMode mode);
// Throws InputError for any other word.
OASLAM_API RelocalizationMode RelocalizationModeOf(const std::string& name);

}  // namespace oaslam
