#pragma once

#include <span>
#include <vector>

#include "oaslam/config.h"
#include "oaslam/estimation/pose_refinement.h"
#include "oaslam/map/map.h"
#include "oaslam/tracking/odometry_link.h"

namespace oaslam {

// The result of searching landmarks in a frame. `reference`: where tracking near a prediction
// failed, that of the prediction; where tracking failed otherwise, invalid.
struct TrackReport : PoseByLandmarks {
  bool success = false;
  int matched = 0;   // landmarks before refinement
  double depth = 0;  // median, of the inliers
  // How much the inliers spread over the image: the sum of squared distances from their mean, in
  // units of the image sides, along the direction in which it is smallest. Few or crowded points
  // give a small value.
  double spread = 0;
  // Standard deviation of the position divided by the median depth of the points.
  double relative_sigma = 0;
  std::vector<LandmarkId> visible;  // landmarks expected in the frame (TrackLocalMap)
};

// Tracks a frame from the previous frame and a predicted pose. Each landmark is searched
// within `radius` of its projection, in pixels of the lowest pyramid level; the radius
// grows with the level.
TrackReport TrackFromLastFrame(const Frame& frame, const Map& map, const Features& last_features,
                               const std::vector<LandmarkId>& last_landmarks,
                               const Rigid3& predicted_cam_from_world, double radius);

// What a pose needs so that tracking may continue from it.
struct TrackDemands {
  // With this many inliers, any share of the matches is enough; with fewer, down to
  // least_inliers, more than half of the matches must be inliers.
  int inliers = 30;
  int least_inliers = 15;
  double relative_sigma = 0.02;  // of the position at most (TrackReport)
  double spread = 0;             // at least (TrackReport)
  // Least geometric mean of two shares, for any number of inliers: the share of the matches that
  // are inliers, and the share of the landmarks expected in the image that are inliers. At a place
  // that partly looks like another one, many matches are wrong and most landmarks are not found.
  double agreement = 0;
  double radius_scale = 1;  // widens the search, after a relocalization
};

// Starts from a rough pose and its matches, searches for all landmarks of the surrounding
// keyframes, and refines the pose on all of them. Succeeds where the result meets the demands.
TrackReport TrackLocalMap(const Frame& frame, const Map& map, const TrackReport& initial,
                          const TrackDemands& demands);

// As TrackLocalMap, but starts from a pose that is known from the motion of the camera, and from
// the landmarks `around` it, which other images saw. The report has a pose and the landmarks that
// agree with it even where these do not meet the demands. Its `reference` is invalid where there
// are no such landmarks.
TrackReport TrackByPrior(const Frame& frame, const Map& map, const ExpectedPose& prior,
                         std::span<const LandmarkId> around, const TrackDemands& demands);

// Refines a pose that few landmarks support, or landmarks in one corner of the image only, with the
// matches of all key points in the previous image (RefinePoseByMatches). Landmarks that no longer
// agree are dropped.
TrackReport StrengthenByMatches(const Frame& frame, const Map& map, const Frame& before,
                                const Rigid3& before_from_world, const TrackReport& tracked,
                                const TrackDemands& demands);

// The part of the map around a frame.
struct LocalMap {
  // First those that share landmarks with the frame, most shared first; then
  // covisible keyframes of these.
  std::vector<KeyframeId> keyframes;
  std::vector<LandmarkId> landmarks;  // all landmarks of these keyframes, each once
};

LocalMap CollectLocalMap(const Map& map, std::span<const LandmarkId> matched, int max_keyframes);

// Tracks an image near the pose that its motion predicts. A pose that many landmarks support is
// accepted anywhere; a pose that few support only near the prediction. On failure, the report has
// the predicted pose and the few landmarks in view that agree with it. `last`: the newest image
// with a pose and features.
TrackReport FollowMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                         const OdometryPrediction& predicted, const TrackDemands& demands);

// Tracks an image whose motion is not known near the last pose of the camera.
TrackReport FollowWithoutMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                                const TrackDemands& demands);

// The predicted pose, without landmarks.
TrackReport ByMotionAlone(const OdometryPrediction& predicted);

// Gives an image without features the predicted pose. Projects the landmarks of the last image with
// this pose, and returns the projections as key points of `features`.
TrackReport CarryByMotion(const Frame& frame, const Map& map, const TrackedFrame& last,
                          const OdometryPrediction& predicted, Features& features);

}  // namespace oaslam
