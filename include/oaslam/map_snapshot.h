#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/anchors.h"
#include "oaslam/camera.h"
#include "oaslam/export.h"
#include "oaslam/rigid3.h"
#include "oaslam/types.h"

namespace oaslam {

// The map at one moment, as data. It is a handle: copies share one map, which never changes. So a
// snapshot costs next to nothing, may be kept as long as one likes, and may be read by several
// threads at once. The functions below copy what they return. Ids ascend in the order of creation
// and are never used again in the same map. Lengths are in map units.
class OASLAM_API MapSnapshot {
 public:
  // An image whose key points are in the map.
  struct Keyframe {
    uint32_t id = 0;
    // TrackingResult::frame of its image; nothing for keyframes of a loaded file
    std::optional<int> frame;
    double timestamp = 0;  // seconds
    int camera = 0;        // index into Cameras()
    Rigid3 world_from_cam;
  };
  // A point of the map.
  struct Landmark {
    uint32_t id = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world
    int observations = 0;                                // number of keyframes that see it
  };
  // A landmark seen in a keyframe.
  struct Observation {
    uint32_t keyframe = 0, landmark = 0;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  // in the image as the camera gave it
    double sigma_px = 1;                              // standard deviation of the pixel
  };
  // An object of the map.
  struct Object {
    uint32_t id = 0;
    int category_id = 0;
    std::string name;     // given by the user, else that of its class
    Ellipsoid ellipsoid;  // world
    // Covariance of the centre (world), the logarithms of the half axes, and the rotation about the
    // vertical (rad).
    Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
    int observations = 0;
    bool has_moved = false;  // since the map was made or loaded
  };

  // An empty map.
  MapSnapshot();

  // Without the copy that Keyframes() makes.
  size_t keyframe_count() const;
  // Without the copy that Landmarks() makes.
  size_t landmark_count() const;

  // In the order of ids.
  std::vector<Keyframe> Keyframes() const;
  // In the order of ids.
  std::vector<Landmark> Landmarks() const;
  // The objects of the map, without tracks that may still become objects.
  std::vector<Object> Objects() const;
  // Empty for an id that is not in the map.
  std::vector<Observation> ObservationsInKeyframe(uint32_t keyframe) const;
  // Empty for an id that is not in the map.
  std::vector<Observation> ObservationsOfLandmark(uint32_t landmark) const;
  // In the order of names.
  std::vector<AnchorPose> Anchors() const;
  // The cameras of the keyframes.
  std::vector<Camera> Cameras() const;

  // The direction opposite to gravity, world; nothing while it is unknown.
  std::optional<Eigen::Vector3d> up() const;
  // Whether the unit is the metre; else it is arbitrary.
  bool is_metric() const;
  // Grows with every change of the map or of the class names; Reset and Load do not set it back.
  // Two snapshots of one Slam with the same version are equal.
  uint64_t version() const;

 private:
  friend class SnapshotMaker;
  struct Content;
  explicit MapSnapshot(std::shared_ptr<const Content> content);
  std::shared_ptr<const Content> content_;
};

}  // namespace oaslam
