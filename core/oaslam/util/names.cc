#include "oaslam/camera.h"
#include "oaslam/config.h"
#include "oaslam/error.h"
#include "oaslam/tracking_result.h"
#include "oaslam/types.h"
#include "oaslam/util/named.h"

namespace oaslam {
namespace {

constexpr Named<TrackingState> kTrackingStates[] = {{TrackingState::kLost, "lost"},
                                                    {TrackingState::kInitializing, "initializing"},
                                                    {TrackingState::kTracking, "tracking"},
                                                    {TrackingState::kRelocalized, "relocalized"},
                                                    {TrackingState::kObjects, "objects"},
                                                    {TrackingState::kOdometry, "odometry"},
                                                    {TrackingState::kPreliminary, "preliminary"}};
constexpr Named<PoseSource> kPoseSources[] = {{PoseSource::kNone, "none"},
                                              {PoseSource::kMap, "map"},
                                              {PoseSource::kMotion, "motion"},
                                              {PoseSource::kObjects, "objects"},
                                              {PoseSource::kRegistration, "registration"}};
constexpr Named<RunnerMode> kRunnerModes[] = {{RunnerMode::kLockstep, "lockstep"},
                                              {RunnerMode::kSequential, "sequential"},
                                              {RunnerMode::kLive, "live"}};
constexpr Named<LensModel> kLensModels[] = {{LensModel::kPinhole, "pinhole"},
                                            {LensModel::kFisheye, "fisheye"}};
constexpr Named<RelocalizationMode> kRelocalizationModes[] = {
    {RelocalizationMode::kPointsAndObjects, "points+objects"},
    {RelocalizationMode::kPoints, "points"},
    {RelocalizationMode::kObjects, "objects"}};
constexpr Named<PoseEvidence> kPoseEvidences[] = {
    {PoseEvidence::kNone, "failed"},
    {PoseEvidence::kPoints, "points"},
    {PoseEvidence::kObjects, "objects"},
    {PoseEvidence::kPointsAndObjects, "points+objects"}};

}  // namespace

const char* ToString(TrackingState state) { return NameIn(kTrackingStates, state); }
const char* ToString(PoseSource source) { return NameIn(kPoseSources, source); }
const char* ToString(RunnerMode mode) { return NameIn(kRunnerModes, mode); }
const char* ToString(LensModel model) { return NameIn(kLensModels, model); }
const char* ToString(RelocalizationMode mode) { return NameIn(kRelocalizationModes, mode); }
const char* ToString(PoseEvidence evidence) { return NameIn(kPoseEvidences, evidence); }

RelocalizationMode RelocalizationModeOf(const std::string& name) {
  if (const auto mode = ValueIn(kRelocalizationModes, name)) return *mode;
  throw InputError("relocalization: " + name + ", allowed: points | objects | points+objects");
}

}  // namespace oaslam
