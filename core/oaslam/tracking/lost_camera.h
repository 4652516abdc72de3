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

// Looks for a camera in the map, and remembers what the images in which it is lost tell together.
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

  // Looks for the newest image, in a map that is only read with the evidence of the images before.
  // `prior`: where the camera may be, world_from_cam; it is looked for there first.
  Relocalization Find(const Frame& frame, const Map& map, const TrackingContext& context,
                      const std::optional<Rigid3>& prior);
  // Looks for an image by itself.
  Relocalization FindAlone(const Frame& frame, const Map& map, RelocalizationMode search);
  // Whether enough time has passed to look again for a camera that the motion carries on: that
  // takes more time than tracking. If so, this counts as the time of the last look.
  bool IsTimeToLook(double timestamp);

  // Takes an image that was found in the map; later ones of its run can be placed by it.
  void Register(const Frame& frame, const Map& map, const Relocalization& found,
                const std::optional<double>& unit) {
    registration_.Add(frame, found, unit, map);
  }
  // The pose of an image by those before that were found in the map, and its motion since.
  std::optional<OdometryRegistration::Registered> Registered(const Frame& frame) const {
    return registration_.PoseOf(frame);
  }

  // Keeps the motion of an image in which the camera is lost.
  void Keep(const Frame& frame);
  // Removes and returns those kept, ascending.
  std::vector<Image> TakeImages();
  // Forgets what earlier images tell of where the camera is.
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
