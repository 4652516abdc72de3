#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/relocalization/relocalizer.h"
#include "oaslam/tracking/odometry_registration.h"
#include "oaslam/tracking/tracking_context.h"
#include "oaslam/util/rng.h"

namespace oaslam {

// Relocalizes a lost camera in the map, and collects the evidence of all images in which it is
// lost.
class LostCamera {
 public:
  explicit LostCamera(const SlamConfig& config);

  // An image in which the camera was lost, and its motion.
  struct Image {
    int frame_index = 0;
    double timestamp = 0;
    std::shared_ptr<const FrameMotion> motion;
  };

  // Uses an index of the map that was made elsewhere.
  void Use(std::shared_ptr<const LandmarkIndex> index) { relocalizer_.Use(std::move(index)); }

  // Relocalizes the newest image. In a map that is only read, the evidence of the images before
  // counts, too. `prior`: supposed pose, world_from_cam, around which landmarks are searched first.
  Relocalization Find(const Frame& frame, const Map& map, const TrackingContext& context,
                      const std::optional<Rigid3>& prior);
  // Relocalizes an image without the evidence of other images.
  Relocalization FindAlone(const Frame& frame, const Map& map, RelocalizationMode search);
  // Whether it is time to relocalize a camera again whose pose is by odometry; relocalization takes
  // more time than tracking. If so, `timestamp` counts as the time of the last relocalization.
  bool IsTimeToLook(double timestamp);

  // Adds an image that was found in the map (OdometryRegistration::Add). Registered uses it for
  // later images of the same run of the odometry.
  void Register(const Frame& frame, const Map& map, const Relocalization& found,
                const std::optional<double>& unit) {
    registration_.Add(frame, found, unit, map);
  }
  // The pose of an image by dead reckoning from the earlier images that were found in the map.
  std::optional<OdometryRegistration::Registered> Registered(const Frame& frame) const {
    return registration_.PoseOf(frame);
  }

  // Keeps the motion of an image in which the camera is lost.
  void Keep(const Frame& frame);
  // Removes and returns the images that were kept, ascending.
  std::vector<Image> TakeImages();
  // Forgets the evidence of earlier images for the pose of the camera.
  void Forget();

 private:
  Relocalizer relocalizer_;
  Rng rng_;
  ObjectTrails trails_;
  OdometryRegistration registration_;
  std::vector<Image> images_;
  double looked_at_ = 0;  // time stamp
};

}  // namespace oaslam
