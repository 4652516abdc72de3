#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/error.h"
#include "oaslam/tracking_result.h"
#include "oaslam/types.h"

namespace oaslam {

const char* ToString(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "initializing";
    case TrackingState::kTracking:
      return "tracking";
    case TrackingState::kRelocalized:
      return "relocalized";
    case TrackingState::kObjects:
      return "objects";
    case TrackingState::kOdometry:
      return "odometry";
    case TrackingState::kPreliminary:
      return "preliminary";
    case TrackingState::kLost:
      break;
  }
  return "lost";
}

const char* ToString(PoseSource source) {
  switch (source) {
    case PoseSource::kMap:
      return "map";
    case PoseSource::kMotion:
      return "motion";
    case PoseSource::kObjects:
      return "objects";
    case PoseSource::kRegistration:
      return "registration";
    case PoseSource::kNone:
      break;
  }
  return "none";
}

const char* ToString(RunnerMode mode) {
  switch (mode) {
    case RunnerMode::kSequential:
      return "sequential";
    case RunnerMode::kLive:
      return "live";
    case RunnerMode::kLockstep:
      break;
  }
  return "lockstep";
}

const char* ToString(LensModel model) {
  return model == LensModel::kFisheye ? "fisheye" : "pinhole";
}

const char* ToString(RelocalizationMode mode) {
  switch (mode) {
    case RelocalizationMode::kPoints:
      return "points";
    case RelocalizationMode::kObjects:
      return "objects";
    case RelocalizationMode::kPointsAndObjects:
      break;
  }
  return "points+objects";
}

const char* ToString(PoseEvidence evidence) {
  switch (evidence) {
    case PoseEvidence::kPoints:
      return "points";
    case PoseEvidence::kObjects:
      return "objects";
    case PoseEvidence::kPointsAndObjects:
      return "points+objects";
    case PoseEvidence::kNone:
      break;
  }
  return "failed";
}

RelocalizationMode RelocalizationModeOf(const std::string& name) {
  for (const RelocalizationMode mode : {RelocalizationMode::kPoints, RelocalizationMode::kObjects,
                                        RelocalizationMode::kPointsAndObjects})
    if (name == ToString(mode)) return mode;
  throw InputError("relocalization: " + name + ", allowed: points | objects | points+objects");
}

}  // namespace oaslam
