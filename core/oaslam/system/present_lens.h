#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/log.h"
#include "oaslam/map/frame.h"
#include "oaslam/map/map.h"
#include "oaslam/odometry/odometry.h"
#include "oaslam/relocalization/relocalizer.h"

namespace oaslam {

// The focal length of the newest image: that of the camera that was given, until the lens is seen
// to change. The odometry follows a lens that zooms or focuses (LensWatch). A lens that is replaced
// by another, as where a phone switches between its cameras, interrupts the odometry: then the
// images are looked for in the map with an unknown focal length. Says what it sees in the log.
class PresentLens {
 public:
  explicit PresentLens(const Camera& camera) : camera_(camera) {}

  // Takes what the odometry tells of an image.
  void See(const OdometryEstimate& estimate, bool is_followed, double timestamp);
  // The motion of an image was given by the caller: nothing tells whether the lens changes.
  void LookAway();
  // Whether the map tells another focal length of the image than the ratio; then the ratio is
  // replaced. Looks for it during the second after the odometry was interrupted, and where a zoom
  // has come to rest: how it began is known to some per cent only.
  bool IsReplaced(const Frame& frame, const std::shared_ptr<const Map>& map,
                  const SlamConfig& config, Relocalizer& relocalizer);

  // Whether the focal length is about to be found: the lens zooms, or the map has measured a new
  // one in few images yet.
  bool IsUncertain() const;
  // The focal length, divided by that of the camera.
  double ratio() const { return ratio_; }
  // The standard deviation of its logarithm.
  double sigma() const;

 private:
  // The lens is followed since the time of an image, at which the ratio was `from`.
  struct Following {
    double since = 0, from = 1;
    std::shared_ptr<const Map> map{};      // as it was then
    double rests_since = 0, rests_at = 1;  // since when the ratio has been about this one
    bool is_measured = false;              // by the map, since it rests
  };
  struct Search {
    double since = 0, looked_at = 0;  // time stamps
    bool has_zoomed = false;
    // As it was before: what was mapped since agrees with the focal length that was taken for
    // right.
    std::shared_ptr<const Map> map{};
    double weight = 0, weighted_log_ratio = 0;  // of the measurements so far
    int looks = 0;                              // images looked at
    int seen = 0, same = 0;  // those that told another focal length, and the same
  };

  LogLevel Level() const;
  bool IsTimeToLook(const Frame& frame, const Map& map);
  bool TellsAnother(double log_ratio, double sigma);
  void LookAfterZoom(double timestamp, const std::shared_ptr<const Map>& map);
  double FocalAt(double ratio) const { return ratio * camera_.fx; }
  std::optional<std::pair<double, double>> Measure(const Frame& frame, const Map& map,
                                                   const SlamConfig& config,
                                                   Relocalizer& relocalizer) const;

  Camera camera_;
  double ratio_ = 1;
  std::optional<Following> following_{};
  std::optional<Search> search_{};
  bool is_blind_ = false;  // the odometry, with the newest image
};

}  // namespace oaslam
