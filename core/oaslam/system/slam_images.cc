// What Slam does with an image: it processes the next one, takes detections that come late, and
// relocalizes.
#include <algorithm>
#include <cmath>
#include <future>
#include <span>
#include <utility>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/relocalization/given_input.h"
#include "oaslam/relocalization/image_search.h"
#include "oaslam/system/slam_impl.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/stopwatch.h"

namespace oaslam {
namespace {

void CheckTimestamp(double timestamp, const std::optional<double>& last) {
  if (!std::isfinite(timestamp)) throw InputError("time stamp is not finite");
  if (last && !(timestamp > *last))
    throw BadInput("time stamp {:.6f} is not after the one before, {:.6f}", timestamp, *last);
}

// Null where the odometry tells no motion. `camera`: with the focal length of the image.
std::shared_ptr<const FrameMotion> MotionOf(OdometryEstimate estimate,
                                            std::span<const OdometryDepth> depths,
                                            const Camera& camera) {
  if (estimate.state == OdometryState::kUncertain || estimate.state == OdometryState::kBlind)
    return nullptr;
  auto motion = std::make_shared<FrameMotion>();
  motion->run = estimate.run;
  motion->image = estimate.image;
  motion->keyframes = std::move(estimate.keyframes);
  motion->cam_from_odom = estimate.cam_from_odom;
  motion->is_preliminary = estimate.state == OdometryState::kPreliminary;
  motion->is_keyframe = estimate.is_keyframe;
  motion->exchanged_since = estimate.exchanged_since;
  motion->scale_drift = estimate.scale_drift;
  motion->agreeing = estimate.inliers / std::max(1.0, static_cast<double>(estimate.tracked));
  if (estimate.metres_per_unit > 0)
    motion->metre =
        MeasuredMetre{estimate.metres_per_unit, estimate.metre_sigma,
                      estimate.metre_is_by_depth ? UnitSource::kDepth : UnitSource::kImu};
  motion->gravity_in_cam = estimate.gravity_in_cam;
  for (const OdometryDepth& d : depths)
    motion->depths.push_back({ProjectIdeal(camera, d.ray.homogeneous()).cast<float>(),
                              static_cast<float>(d.inverse_depth)});
  return motion;
}

}  // namespace

void TakePose(const ImagePose& pose, TrackingResult& result) {
  const bool looked = result.keypoints > 0;  // for landmarks
  result.state = pose.state;
  result.source = pose.source;
  result.SetPose(pose.cam_from_world ? std::optional(pose.cam_from_world->Inverse())
                                     : std::nullopt);
  result.matched = looked ? std::optional(pose.matched) : std::nullopt;
  result.inliers = looked ? std::optional(pose.inliers) : std::nullopt;
  result.objects = pose.objects;
  result.confidence = pose.confidence;
  result.covariance = pose.covariance;
  result.is_uncertain = pose.is_uncertain;
  result.seconds_without_map = pose.seconds_without_map;
  result.depth = pose.depth;
}

Frame Slam::Impl::MakeFrame(const ImageInput& input, int index, int keypoints) {
  return frame_maker_.Make(input, index, keypoints, session().snapshot()->classes);
}

Frame Slam::Impl::FrameOfBoxes(const ImageInput& input, double timestamp) const {
  return {0,
          timestamp,
          frame_maker_.camera(),
          {},
          CheckedDetections(*frame_maker_.camera(), input.detections),
          false,
          input.gravity_in_cam};
}

// The image in grey, without what the mask hides.
ImageInput Slam::Impl::Prepared(const ImageInput& input) {
  ImageInput grey = input;
  const bool has_image = !input.image.empty();
  if (has_image) grey.image = ToGrey(input.image);
  repeated_s_ = has_image ? repeated_images_.Add(grey.image, input.timestamp) : 0;
  if (has_image && still_parts_ && still_parts_->Add(ViewOf(grey.image), input.timestamp)) {
    SetMask(still_parts_->mask());
    Log(LogLevel::kWarning,
        "a part of the images moves with the camera, and is left out from now on: {}",
        Describe(mask_));
  }
  EraseHidden(mask_, {camera_.width, camera_.height}, grey.detections);
  return grey;
}

// How the camera moved; null where this image tells nothing.
std::shared_ptr<const FrameMotion> Slam::Impl::FindMotion(
    const ImageInput& grey, const std::shared_ptr<const DepthMap>& depth) {
  if (grey.motion) {
    lens_.LookAway();
    return MotionOf(*grey.motion, camera_);
  }
  if (grey.image.empty()) return nullptr;
  OdometryEstimate estimate = odometry_->Process(ViewOf(grey.image), grey.timestamp,
                                                 {grey.angular_velocity, grey.imu, depth});
  lens_.See(estimate, odometry_->FollowsLens(), grey.timestamp);
  return MotionOf(std::move(estimate), odometry_->Depths(), Zoomed(camera_, lens_.ratio()));
}

Frame Slam::Impl::WithFeatures(const ImageInput& grey) {
  return MakeFrame(grey, next_index_, config_.features.count * (atlas_->IsInitializing() ? 2 : 1));
}

// Where it is known beforehand that features are needed. `motion_cpu_ms`: the CPU time of the other
// thread.
Frame Slam::Impl::FeaturesBesideMotion(const ImageInput& grey,
                                       const std::shared_ptr<const DepthMap>& depth,
                                       double& motion_cpu_ms) {
  auto finding = std::async(std::launch::async, [&] {
    const Stopwatch watch;
    auto motion = FindMotion(grey, depth);
    motion_cpu_ms = watch.ThreadCpuMs();
    return motion;
  });
  Frame frame = WithFeatures(grey);
  const std::shared_ptr<const FrameMotion> motion = finding.get();
  if (frame_maker_.UseFocalRatio(lens_.ratio(), lens_.sigma())) frame = WithFeatures(grey);
  frame.motion = motion;
  return frame;
}

// Where the motion tells whether features are needed, or for which focal length.
Frame Slam::Impl::FeaturesAfterMotion(const ImageInput& grey,
                                      const std::shared_ptr<const DepthMap>& depth) {
  const std::shared_ptr<const FrameMotion> motion = FindMotion(grey, depth);
  frame_maker_.UseFocalRatio(lens_.ratio(), lens_.sigma());
  Frame frame = !motion || atlas_->NeedsFeatures(grey.timestamp, motion.get())
                    ? WithFeatures(grey)
                    : frame_maker_.MakeWithoutFeatures(grey, next_index_);
  frame.motion = motion;
  return frame;
}

Frame Slam::Impl::MakeNextFrame(const ImageInput& input, double& cpu_ms) {
  frame_maker_.Check(input);
  const Stopwatch watch;
  const ImageInput grey = Prepared(input);
  const std::shared_ptr<const DepthMap> depth =
      input.depth ? depth_registration_.Register(*input.depth, camera_) : nullptr;
  const bool are_features_needed =
      atlas_->NeedsFeatures(input.timestamp, nullptr) && !odometry_->FollowsLens();
  double motion_cpu_ms = 0;
  Frame frame = are_features_needed ? FeaturesBesideMotion(grey, depth, motion_cpu_ms)
                                    : FeaturesAfterMotion(grey, depth);
  cpu_ms = watch.ThreadCpuMs() + motion_cpu_ms;
  if (!odometry_->RefusesDepth()) frame.depth = depth;
  return frame;
}

// Where the camera has another lens since the frame was made: makes it again, for that lens.
void Slam::Impl::TakeReplacedLens(const ImageInput& input, Frame& frame) {
  if (camera_.is_guess || !lens_.IsReplaced(frame, session().snapshot(), config_, relocalizer_))
    return;
  odometry_->ReplaceLens(lens_.ratio());
  frame_maker_.UseFocalRatio(lens_.ratio(), lens_.sigma());
  ImageInput again = input;
  EraseHidden(mask_, {camera_.width, camera_.height}, again.detections);
  frame = MakeFrame(again, next_index_, config_.features.count);
}

// What an image shows that the camera has given before says nothing of where the camera is now.
void Slam::Impl::DoubtRepeated(TrackingResult& result) {
  // A video may repeat an image or two, where its rate was changed.
  constexpr double kSeconds = 0.2;
  constexpr double kEven = 0.5;  // whether the camera has stayed since is not known
  const bool was_repeating =
      std::exchange(is_repeating_, repeated_s_ >= kSeconds && result.HasPose());
  if (!is_repeating_) return;
  if (!was_repeating)
    Log(LogLevel::kWarning, "the camera has given the same image since {:.2f} s",
        result.timestamp - repeated_s_);
  result.is_uncertain = true;
  result.confidence = std::min(result.confidence, kEven);
}

// What is told of an image, but for the times that it took.
TrackingResult Slam::Impl::MakeResult(const Frame& frame, const TrackingStep& step) {
  TrackingResult result;
  result.frame = frame.index - first_index_;
  result.timestamp = frame.timestamp;
  result.world = world();
  result.keypoints = frame.features_skipped ? 0 : frame.features->size();
  TakePose(step.pose, result);
  result.focal_ratio = lens_.ratio();
  if (result.HasPose() && lens_.IsUncertain()) result.is_uncertain = true;
  DoubtRepeated(result);
  result.elsewhere = PosesElsewhere(result);
  if (result.HasPose()) result.motion_unit = session().tracker().MotionUnit(frame);
  return result;
}

TrackingResult Slam::Impl::Process(const ImageInput& input) {
  ExpectMapping();
  CheckTimestamp(input.timestamp, last_timestamp_);
  const Stopwatch making;
  double making_cpu_ms = 0;
  Frame frame = MakeNextFrame(input, making_cpu_ms);
  TakeReplacedLens(input, frame);
  if (frame.motion && !frame.gravity_in_cam) frame.gravity_in_cam = frame.motion->gravity_in_cam;
  last_timestamp_ = input.timestamp;
  ++next_index_;
  const double ms_features = making.WallMs();

  const Stopwatch tracking;
  const TrackingStep step = atlas_->Process(frame);
  const double ms_track = tracking.WallMs(), tracking_cpu_ms = tracking.ThreadCpuMs();
  if (step.pose.cam_from_world && !is_mapping_)
    audit_.Add(frame, *step.pose.cam_from_world, *session().snapshot(), config_.objects);

  newest_ = MakeResult(frame, step);
  newest_.detections = static_cast<int>(input.detections.size());
  newest_.ms_features = ms_features;
  newest_.ms_track = ms_track;
  newest_.ms_total = ms_features + ms_track;
  newest_.ms_objects = step.ms_objects;
  newest_.cpu_ms = making_cpu_ms + tracking_cpu_ms;
  Post();
  TakeMetre();
  TakeSensorsMetre(false);
  return newest_;
}

std::optional<int> Slam::Impl::AddDetections(int frame, const std::vector<Detection>& given) {
  std::vector<Detection> detections = given;
  EraseHidden(mask_, {camera_.width, camera_.height}, detections);
  const std::vector<ObjectDetection> ideal = CheckedDetections(*frame_maker_.camera(), detections);
  const std::optional<TrackingStep> step = atlas_->AddDetections(frame + first_index_, ideal);
  if (!step || !step->pose.cam_from_world) return std::nullopt;
  if (frame == newest_.frame) {
    newest_.detections = static_cast<int>(detections.size());
    newest_.objects = step->pose.objects;
    if (!newest_.HasPose()) TakePose(step->pose, newest_);
    newest_.elsewhere = PosesElsewhere(newest_);
    Post();
  }
  return step->pose.objects;
}

RelocalizationResult Slam::Impl::Find(const Frame& frame, const RelocalizeOptions& options,
                                      double ms_features) {
  // A fresh random generator for each image: no answer depends on the random numbers before.
  Rng rng(static_cast<uint64_t>(config_.runner.seed));
  const Stopwatch watch;
  const RelocalizationMode mode = frame.features ? options.mode : RelocalizationMode::kObjects;
  const Relocalization found = relocalizer_.Find(
      frame, *session().snapshot(), mode, rng, options.follow ? &trails_ : nullptr, options.prior);
  RelocalizationResult result = ResultOf(found);
  result.ms_features = ms_features;
  result.ms = watch.WallMs();
  if (result.world_from_cam)
    audit_.Add(frame, found.cam_from_world, *session().snapshot(), config_.objects);
  return result;
}

RelocalizationResult Slam::Impl::Relocalize(const ImageInput& input,
                                            const RelocalizeOptions& options) {
  if (options.unknown_camera)
    return FindWithUnknownCamera(input, *frame_maker_.camera(), options, *session().snapshot(),
                                 config_, frame_maker_, relocalizer_);
  if (options.camera && *options.camera != *frame_maker_.camera()) {
    FrameMaker maker(config_, *options.camera);
    return FindImage(input, *options.camera, options, *session().snapshot(), config_, maker,
                     relocalizer_);
  }
  if (options.follow) CheckTimestamp(input.timestamp, last_followed_);
  const Stopwatch watch;
  Frame frame = input.image.empty() && !input.features
                    ? FrameOfBoxes(input, options.follow ? input.timestamp : 0)
                    : MakeFrame(input, 0, config_.features.count);
  if (input.depth && !odometry_->RefusesDepth())
    frame.depth = depth_registration_.Register(*input.depth, *frame.camera);
  if (options.follow) last_followed_ = input.timestamp;
  return Find(frame, options, watch.WallMs());
}

}  // namespace oaslam
