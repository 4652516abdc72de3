#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/map.h"
#include "oaslam/tracking/tracking_context.h"

namespace oaslam {

// The standard deviation of a position where the translation of the camera is not known, as a share
// of the depth: a guess of how far a hand mostly moves a camera in a tenth of a second.
inline constexpr double kUnknownWay = 0.03;

// The median depth of the points that the odometry follows, in its unit; 0 without any. Of the
// points with an inverse depth above `above`: noise may place one that is far away beyond infinity.
double MedianDepthOf(const FrameMotion& motion, float above = -INFINITY);

// The camera's motion between two images, in the unit of the map.
struct MotionInMap {
  Rigid3 cam_from_cam;  // the later camera from the earlier one
  double sigma_position = 0, sigma_rotation = 0;
  bool is_turn = false;                   // only the rotation of the motion is known
  double metres = 0, relative_sigma = 0;  // as of KeyframeMotion
};

// A pose by dead reckoning: by the camera's motion since the map last gave a pose.
struct OdometryPrediction {
  ExpectedPose expected;
  KeyframeId reference;
  bool is_turn = false;  // only the rotation of the motion is known
  double depth = 0;      // median, of the points that the odometry follows; map units
};

// Estimates the pose and the unit of the odometry's frame in the map, from images whose pose the
// map gave.
class OdometryLink {
 public:
  // Begins with a map in the frame and the unit of the odometry. `frame`: of the map's newest
  // keyframe; `depth`: median depth of the landmarks that this keyframe sees, map units.
  void Begin(const Frame& frame, KeyframeId keyframe, double depth);
  // Takes an image whose pose the map gave, and estimates the odometry's unit from points whose
  // depth is known to the map and to the odometry. `depth`: median depth of its landmarks, map
  // units. `before`: the image before; null where the camera was lost.
  void See(const TrackedFrame& seen, double depth, const Map& map, const TrackedFrame* before);
  // Takes an image that becomes a keyframe of the map.
  void AddKeyframe(KeyframeId id, const Frame& frame);
  // Takes an image with which the odometry corrected its motion (FrameMotion::exchanged_since).
  // Returns the newest keyframe whose motion was right, from which predictions start now; nothing
  // where none is known.
  std::optional<KeyframeId> Correct(const Frame& frame);
  // Multiplies the lengths kept here by `factor`, after those of the map were.
  void Scale(double factor);
  // Multiplies the lengths that are relative to each of these keyframes by its factor.
  void Scale(const std::map<KeyframeId, double>& factors);

  // The pose by dead reckoning from the last image whose pose the map gave, or from a later
  // keyframe once the mapper has added it. Nothing where the motion is not known, where only its
  // rotation has been known for too long, or where a map that is only read has given no pose for
  // too long.
  std::optional<OdometryPrediction> Predict(const Frame& frame, const Map& map, MapUse use) const;
  // The motion from an earlier image; nothing where the odometry was interrupted in between.
  std::optional<MotionInMap> MotionSince(const std::shared_ptr<const FrameMotion>& before,
                                         const Frame& frame) const;
  std::optional<MotionInMap> MotionSinceKeyframe(const Frame& frame) const;
  // The motions to the newest keyframe and to the keyframes before it in the odometry's window,
  // each from its predecessor, by the odometry's present estimates. The odometry goes on correcting
  // these estimates; a chain of the first ones would keep their errors.
  std::vector<std::pair<KeyframeId, KeyframeMotion>> MotionsToKeyframes(const Frame& frame) const;
  // Whether the motion alone can give an image its pose. `motion`: null as long as it is not known.
  bool CanCarry(double timestamp, const FrameMotion* motion, MapUse use) const;

  // The length of the odometry's unit in units of the map; nothing for an image of another run.
  std::optional<double> UnitFor(const Frame& frame) const;
  // The mean relative deviation of the units that single images give: how constant the scales of
  // the odometry and of the map are in this recording.
  double spread() const { return (unit_ ? *unit_ : Unit()).spread; }
  // The length of the map's unit in metres; nothing where no sensor tells it.
  std::optional<MeasuredMetre> metre() const;
  double seen_at() const { return seen_at_; }  // time stamp of the newest image that See took
  double depth() const { return depth_; }      // of that image

 private:
  struct Unit {
    int run = 0;    // FrameMotion::run
    int loops = 0;  // closed in the map: each may have changed its scale
    double length = 1;
    double seconds = 0;  // over which it was averaged
    // The spread begins as a guess that has the weight of one second of images.
    double spread = 0.03, spread_seconds = 1;
  };
  // The length of the map's unit in metres: the mean over the images so far, which count by how
  // well the odometry knew the length of its own.
  struct Metre {
    double log_sum = 0, weight = 0;
    double relative_sigma = 0;  // of the newest image
    UnitSource source = UnitSource::kImu;

    double length() const { return std::exp(log_sum / weight); }
  };
  // An image with a known pose relative to a keyframe: a start of predictions.
  struct Start {
    std::shared_ptr<const FrameMotion> motion;
    KeyframeId reference;
    Rigid3 cam_from_reference;
  };

  void Learn(const TrackedFrame& seen, const Map& map, const TrackedFrame* before);
  void LearnUnit(const TrackedFrame& seen, const Map& map, const TrackedFrame* before);
  void LearnMetre(const FrameMotion& motion, double seconds);
  std::optional<MotionInMap> MotionBetween(const std::shared_ptr<const FrameMotion>& before,
                                           const std::shared_ptr<const FrameMotion>& now,
                                           const Frame& newest) const;
  bool IsYoung(double timestamp) const;
  bool IsTooLongAgo(double timestamp, MapUse use) const;  // since the map was seen

  std::optional<Unit> unit_;
  std::optional<Metre> metre_;
  // The last image that See took, and the keyframes since, ascending. The last keyframe is not in
  // the map as long as the mapper works on it.
  std::vector<Start> starts_;
  // The motions of the newest keyframes, ascending.
  std::vector<std::pair<KeyframeId, std::shared_ptr<const FrameMotion>>> keyframes_;
  double map_began_at_ = -INFINITY;  // time stamp
  double seen_at_ = -INFINITY;
  double depth_ = 0;
};

}  // namespace oaslam
