#include "oaslam/odometry/odometry.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/odometry/pose_starts.h"
#include "oaslam/odometry/rivals.h"

namespace oaslam {
namespace {

constexpr int kLevels = 5;  // of the pyramid: 16 px there are 256 of the image
// Fewer agree on a pose by chance. Right poses of rooms, a drive and a hand-held camera have 111
// and more, wrong ones of stills with large steps 4 to 14.
constexpr int kLeastPoints = 30;
// Where a smaller share fits, the motion is wrong: in 15 of 16 images of nine walks at 5 and 3 Hz.
// At 30 Hz a larger one fits, in rooms, in a drive, and in the fast turns of a hand.
constexpr double kLeastShare = 0.6;
// Where a smaller share of the points agrees with the pose, its search may have ended in a wrong
// minimum. With .90 a walk at 5 Hz loses images that other starts would place.
constexpr double kDoubtful = 0.95;

// How often an image must be halved until it fits.
int HalvingsOf(int width, int max_width) {
  int halvings = 0;
  for (; width > max_width; width = (width + 1) / 2) ++halvings;
  return halvings;
}

Camera Halved(Camera camera, int times) {
  for (int i = 0; i < times; ++i) {
    camera.width = (camera.width + 1) / 2;
    camera.height = (camera.height + 1) / 2;
    for (double* x : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *x /= 2;
  }
  return camera;
}

// What is seen in darkness, noise of the image and of its compression, does not move with the
// scene.
bool ContradictsGyroscope(const Rigid3& pose, const PoseFitPrior& prior) {
  constexpr double kSurelyOff = 8, kMost = 0.5 * kDegree;
  if (!prior.rotation) return false;
  const double off = pose.rotation.angularDistance(prior.rotation->second_from_first);
  return off > std::max(kMost, kSurelyOff * std::sqrt(prior.rotation->variance));
}

}  // namespace

const char* ToString(OdometryState state) {
  switch (state) {
    case OdometryState::kPreliminary:
      return "preliminary";
    case OdometryState::kTracking:
      return "tracking";
    case OdometryState::kUncertain:
      return "uncertain";
    case OdometryState::kInertial:
      return "inertial";
    case OdometryState::kBlind:
      return "blind";
  }
  return "";
}

Odometry::Odometry(const Camera& camera, const OdometryOptions& options, uint64_t seed)
    : options_(options),
      rng_(seed),
      halvings_(HalvingsOf(camera.width, options.max_width)),
      camera_(Halved(camera, halvings_)),
      focal_(camera_.fx),
      max_lens_angle_(MaxLensAngle(camera_)),
      depth_({camera_.cx, camera_.cy}, std::ldexp(1, halvings_)) {
  window_options_.focal_px = 0.5 * (camera_.fx + camera_.fy);
}

OdometryEstimate Odometry::Process(const GreyImage& image, double time_s,
                                   const OdometrySensors& sensors) {
  imu_.Add(sensors.angular_velocity, sensors.imu, window_);
  depth_.Take(time_s, sensors.depth);
  // Depths that came late: what the images have told so far is without a metre, and preliminary.
  if (is_beginning_ && !window_.images.empty() && depth_.CanBegin(window_)) BeginAnew();
  present_ = TrackedImage(image);
  OdometryEstimate estimate;
  if (!window_.images.empty()) ProcessNext(time_s, estimate);
  if (estimate.state == OdometryState::kBlind) {
    // What comes after has no known place: it begins anew, with this image.
    BeginAnew();
  }
  if (window_.images.empty()) {
    BeginFirst(time_s);
    estimate.is_keyframe = true;
    if (!is_beginning_ && estimate.state != OdometryState::kBlind)
      estimate.state = OdometryState::kTracking;
  }
  estimate.run = run_;
  estimate.image = window_.newest().id;
  estimate.scale_drift = scale_drift_;
  estimate.focal_ratio = lens_.ratio();
  TellMetre(estimate);
  last_motions_.push_back({time_s, window_.newest().cam_from_odom});
  if (last_motions_.size() > 2) last_motions_.erase(last_motions_.begin());
  if (!is_beginning_)
    for (const WindowImage& member : window_.images)
      if (member.is_keyframe) estimate.keyframes.emplace_back(member.id, member.cam_from_odom);
  last_ = present_;
  if (estimate.is_keyframe) keyframes_.push_back({keyframe_id_, present_});
  // In a fast turn each image is a keyframe: the errors of patches that are followed from one to
  // the next add up. 4 and 15 are worse (docs/lab/odometry.md).
  constexpr size_t kKept = 8;
  if (keyframes_.size() > kKept) keyframes_.erase(keyframes_.begin());
  Forget();
  return estimate;
}

// The length of a metre and gravity, as the sensors tell them.
void Odometry::TellMetre(OdometryEstimate& estimate) const {
  if (window_.inertial) {
    estimate.metres_per_unit = window_.inertial->value[0];
    estimate.metre_sigma = imu_.metre_sigma();
    estimate.gravity_in_cam =
        window_.newest().cam_from_odom.rotation * window_.inertial->value.segment<3>(1);
  }
  if (depth_.units_per_metre() > 0) {
    // The calibration of a depth camera is off by about so much.
    constexpr double kSigma = 0.01;
    estimate.metres_per_unit = 1 / depth_.units_per_metre();
    estimate.metre_sigma = kSigma;
    estimate.metre_is_by_depth = true;
  }
}

void Odometry::BeginAnew() {
  ++run_;
  window_ = {};
  is_beginning_ = true;
  leader_.reset();
  keyframes_.clear();
  doubt_ = 0;
  rival_watch_ = {};
  last_motions_.clear();
  imu_.BeginRun();
  depth_.ForgetMetre();
}

void Odometry::ReplaceLens(double ratio) {
  lens_.Replace(ratio);
  UseFocalRatio(ratio);
  if (!window_.images.empty()) BeginAnew();
}

void Odometry::SetImu(const Rigid3& cam_from_imu) {
  imu_.Replace(cam_from_imu, window_);
  if (!window_.images.empty()) BeginAnew();
}

void Odometry::SetMask(const ImageMask& mask) {
  mask_ = mask;
  if (!window_.images.empty()) BeginAnew();
}

void Odometry::ProcessNext(double time_s, OdometryEstimate& estimate) {
  WindowImage next;
  next.id = window_.newest().id + 1;
  next.time_s = time_s;
  imu_.Measure(window_.newest().time_s, next);
  window_.images.push_back(std::move(next));
  window_.newest().cam_from_odom = Predict(time_s, window_.newest().turn);
  estimate.tracked = Follow();
  depth_.MeasureSightings(window_);
  const Rigid3 predicted = window_.newest().cam_from_odom;
  if (estimate.tracked < kLeastPoints) {
    FollowInertia(predicted, estimate);
    return;
  }
  estimate.is_keyframe = NeedsKeyframe(estimate);
  if (estimate.is_keyframe) estimate.tracked = FitPatches();
  if (is_beginning_) {
    EstimateBeginning(estimate);
    estimate.is_keyframe = estimate.is_keyframe || keyframe_is_due_;
  } else {
    EstimatePose(predicted, estimate);
    if (estimate.inliers < kLeastPoints || estimate.inliers < kLeastShare * estimate.tracked) {
      FollowInertia(predicted, estimate);
      return;
    }
  }
  seen_s_ = time_s;
  const double elapsed = time_s - window_.images[window_.images.size() - 2].time_s;
  const bool is_uncertain =
      !is_beginning_ && !window_.inertial &&
      IsUncertain(elapsed, static_cast<double>(estimate.inliers) / estimate.tracked);
  if (is_uncertain) estimate.state = OdometryState::kUncertain;
  LearnGyroscope(estimate);
  if (estimate.is_keyframe) MakeKeyframe();
}

// From two images in a row that fit well.
void Odometry::LearnGyroscope(const OdometryEstimate& estimate) {
  const bool was_sure =
      std::exchange(is_sure_, estimate.state == OdometryState::kTracking &&
                                  estimate.inliers >= kDoubtful * estimate.tracked);
  if (!was_sure || !is_sure_) return;
  imu_.Calibrate(window_.images[window_.images.size() - 2], window_.newest());
}

// Whether, within the last images, the camera turned so fast that images are blurred, and too many
// points did not fit: after such a swing poses were off by several degrees. Slower turns may lose
// as many points, and be right (docs/lab/odometry.md). What follows is a new run.
bool Odometry::IsUncertain(double elapsed, double share_of_inliers) {
  constexpr double kFast = 3;  // rad/s
  constexpr double kUsual = 0.9, kMost = 0.08, kSeconds = 0.5;
  const double turn = window_.newest().cam_from_odom.rotation.angularDistance(
      last_motions_.back().cam_from_odom.rotation);
  doubt_ *= std::exp(-elapsed / kSeconds);
  if (turn > kFast * elapsed) doubt_ += std::max(0.0, kUsual - share_of_inliers);
  const bool was_uncertain = is_uncertain_;
  is_uncertain_ = doubt_ > (was_uncertain ? kMost / 2 : kMost);
  if (is_uncertain_ && !was_uncertain) ++run_;
  doubt_ = std::min(doubt_, kMost);  // a long swing is forgotten as soon as a short one
  return is_uncertain_;
}

std::vector<OdometryDepth> Odometry::Depths() const {
  std::vector<OdometryDepth> depths;
  if (is_beginning_) return depths;
  for (const WindowPoint& p : window_.points)
    if (p.is_tracked && p.HasDepth() && !p.sightings.empty() &&
        p.sightings.back().image == window_.newest().id)
      depths.push_back({p.sightings.back().ray, window_.InverseDepthIn(p, window_.newest())});
    else if (p.is_measured && p.anchor == window_.newest().id)
      depths.push_back({p.ray, p.inverse_depth});
  return depths;
}

std::shared_ptr<const GreyPyramid> Odometry::TrackedImage(const GreyImage& image) {
  auto unused = std::ranges::find_if(pyramids_, [](const auto& p) { return p.use_count() == 1; });
  if (unused == pyramids_.end()) unused = pyramids_.insert(unused, std::make_shared<GreyPyramid>());
  (*unused)->Set(image, halvings_, kLevels, halved_);
  return *unused;
}

void Odometry::BeginFirst(double time_s) {
  window_.images.push_back({0, time_s, Rigid3(), true, true});
  preliminary_ = {};
  keyframe_id_ = 0;
  AddFirstPoints();
}

// Velocity and angular velocity stay, unless a gyroscope tells the rotation.
Rigid3 Odometry::Predict(double time_s, const std::optional<Turn>& measured) const {
  const Motion& last = last_motions_.back();
  if (last_motions_.size() < 2) {
    // The first image is where the odometry begins.
    return measured ? Rigid3(measured->second_from_first * last.cam_from_odom.rotation,
                             Eigen::Vector3d::Zero())
                    : last.cam_from_odom;
  }
  const Motion& before = last_motions_.front();
  constexpr double kMaxShare = 2;  // after a pause the camera may do anything
  const double share = std::min(kMaxShare, (time_s - last.time_s) / (last.time_s - before.time_s));
  const Eigen::AngleAxisd usual(
      Eigen::Quaterniond(last.cam_from_odom.rotation * before.cam_from_odom.rotation.conjugate()));
  const Eigen::Vector3d center = last.cam_from_odom.OriginInSource(),
                        step = center - before.cam_from_odom.OriginInSource();
  const Eigen::Quaterniond turn =
      measured ? Eigen::Quaterniond(measured->second_from_first)
               : Eigen::Quaterniond(Eigen::AngleAxisd(share * usual.angle(), usual.axis()));
  const Eigen::Quaterniond rotation = turn * Eigen::Quaterniond(last.cam_from_odom.rotation);
  if (const auto by_inertia = CenterByInertia(window_, Rigid3::Rotation(rotation)))
    return Rigid3(Rigid3::Rotation(rotation), rotation * -*by_inertia);
  return Rigid3(Rigid3::Rotation(rotation),
                rotation * -(is_beginning_ ? center : center + share * step));
}

Eigen::Vector2d Odometry::RayAt(const Eigen::Vector2f& px) const {
  return RayOf(camera_, Undistort(camera_, max_lens_angle_, px.cast<double>())).head<2>();
}

// The points that the newest image sees, with the depths that are known. `pose`: about that of the
// image.
std::vector<PosePoint> Odometry::NewestPoints(const Rigid3& pose) const {
  std::vector<PosePoint> points;
  for (const WindowPoint& p : window_.points) {
    if (p.sightings.empty() || p.sightings.back().image != window_.newest().id) continue;
    const WindowImage& anchor = window_.Image(p.anchor);
    points.push_back({anchor.cam_from_odom.rotation.conjugate() * p.ray.homogeneous(),
                      anchor.cam_from_odom.OriginInSource(), p.inverse_depth,
                      std::min(p.variance, p.prior_sigma * p.prior_sigma), p.sightings.back().ray,
                      p.edge.In(pose * anchor.cam_from_odom.Inverse()).Covariance()});
  }
  return points;
}

void Odometry::UseFocalRatio(double ratio) {
  const double change = focal_ * ratio / camera_.fx;
  camera_.fx *= change;
  camera_.fy *= change;
  window_options_.focal_px *= change;
}

// Returns whether the lens has changed; then the newest image is measured with its new focal
// length.
bool Odometry::WatchLens(std::span<const PosePoint> points, const PoseFitPrior& prior,
                         const Rigid3& pose) {
  const FocalChange change = FocalChangeOf(points, window_options_, prior, pose);
  if (!lens_.Add(change, window_.newest().time_s)) return false;
  UseFocalRatio(lens_.ratio());
  for (WindowPoint& p : window_.points)
    if (!p.sightings.empty() && p.sightings.back().image == window_.newest().id)
      p.sightings.back().ray = RayAt(p.sightings.back().px);
  return true;
}

void Odometry::EstimatePose(const Rigid3& predicted, OdometryEstimate& estimate) {
  estimate.state = OdometryState::kTracking;
  const WindowImage& last = window_.images[window_.images.size() - 2];
  const double elapsed = window_.newest().time_s - last.time_s;
  std::vector<PosePoint> points = NewestPoints(predicted);
  // Of a first step the velocity before is not known.
  const double change = last_motions_.size() < 2 ? 1 : elapsed;
  PoseFitPrior prior{predicted.OriginInSource(),
                     std::max(1e-4, window_options_.velocity_sigma * elapsed * change /
                                        window_.median_inverse_depth)};
  if (const std::optional<Turn>& turn = window_.newest().turn)
    prior.rotation = Turn{turn->second_from_first * last.cam_from_odom.rotation, turn->variance};
  Rigid3 pose = RefinePose(points, window_options_, prior, kFarStart, predicted);
  if (options_.watches_lens && WatchLens(points, prior, pose)) {
    points = NewestPoints(pose);
    pose = RefinePose(points, window_options_, prior, 1, pose);
  }
  if (window_.inertial && ContradictsGyroscope(pose, prior)) {
    estimate.inliers = 0;
    return;
  }
  // Points that do not fit show a wrong minimum. Where all do, the pose alone is enough until a
  // keyframe tells more of the depths.
  const bool fits = ShareThatFits(pose) >= kDoubtful;
  if (fits && !estimate.is_keyframe)
    window_.newest().cam_from_odom = pose;
  else if (fits)
    OptimizeWindow(std::span(&pose, 1));
  else
    OptimizeWindow(
        PoseStarts(points, window_options_, prior, predicted, pose, RotationOfFlow(predicted),
                   (predicted.OriginInSource() - last.cam_from_odom.OriginInSource()).norm()));
  WindowFit fit = FlagOutliers(window_options_, window_);
  if (LookForRival(fit.cost, estimate)) fit = FlagOutliers(window_options_, window_);
  if (estimate.is_keyframe) AddScaleDrift();
  estimate.covariance = covariance_;
  estimate.tracked = fit.compared;
  estimate.inliers = fit.inliers;
  UpdateMedianDepth(true, window_);
  estimate.cam_from_odom = window_.newest().cam_from_odom;
}

// The window tells how well its newest images hold the scale of the images before it, which are
// held: so much the scale wanders in the time between.
void Odometry::AddScaleDrift() {
  // Errors of sightings are alike from image to image, so that scales wander by more than their
  // normal equations say: in 26 walks by 2.3 to 3 times as much over six seconds, whatever they say
  // (docs/lab/odometry.md).
  constexpr double kOfSigma = 2.5;
  constexpr double kMost = 1;  // in one step: nothing is known of it
  const double now = window_.newest().time_s;
  double held = window_.images.front().time_s, keyframe = held;
  for (const WindowImage& image : window_.images) {
    if (image.is_held) held = image.time_s;
    if (image.is_keyframe) keyframe = image.time_s;
  }
  const double added =
      kOfSigma * kOfSigma * scale_variance_ * (now - keyframe) / std::max(1e-6, now - held);
  // Where a sensor holds the metre, the scale wanders no further than the sensor's errors.
  constexpr double kOfMetre = 0.003;  // in a second
  const double most = window_.inertial || depth_.units_per_metre() > 0
                          ? kOfMetre * kOfMetre * std::max(0.0, now - keyframe)
                          : kMost;
  scale_drift_ += added >= 0 && added < most ? added : most;
}

// Looks, from time to time, whether another motion explains the newest images better, and takes it.
// `cost`: WindowFit::cost. Returns whether there was one.
bool Odometry::LookForRival(double cost, OdometryEstimate& estimate) {
  const auto span_s = rival_watch_.SpanToLookAt(window_.newest().time_s, cost);
  if (!span_s) return false;
  std::optional<Rival> rival = BetterMotion(window_, *span_s, window_options_, solver_, rng_);
  if (!rival) return false;
  window_ = std::move(rival->window);
  FlagOutliers(window_options_, window_);  // as they are by this motion
  const Rigid3 pose = window_.newest().cam_from_odom;
  OptimizeWindow(std::span(&pose, 1));
  // The velocity of the motion that was wrong says nothing.
  const WindowImage& last = window_.images[window_.images.size() - 2];
  last_motions_ = {{last.time_s, last.cam_from_odom}};
  estimate.exchanged_since = rival->since;
  estimate.is_keyframe = true;  // what is seen now is known by the new motion
  return true;
}

// The share of the newest image's sightings that are no outliers, were this its pose.
double Odometry::ShareThatFits(const Rigid3& cam_from_odom) const {
  int seen = 0, fits = 0;
  const std::vector<Rigid3> from = window_.FromImages(cam_from_odom);
  for (const WindowPoint& p : window_.points) {
    if (p.sightings.empty() || p.sightings.back().image != window_.newest().id || !p.DidFit())
      continue;
    const Rigid3& there = from[window_.IndexOf(p.anchor)];
    const auto px = PxOf(there, p);
    ++seen;
    fits += px && p.edge.In(there).Off((*px - p.px).cast<double>()) < window_options_.outlier_px;
  }
  return static_cast<double>(fits) / std::max(1, seen);
}

// From each start of the newest pose; keeps the best.
void Odometry::OptimizeWindow(std::span<const Rigid3> starts) {
  const WindowProblem made = ProblemOf(window_, window_options_, false);
  const int newest = made.PoseOf(window_, window_.newest().id);
  constexpr int kIterations = 4, kMoreIterations = 4;  // from the last minimum; from another start
  SchurOptions options{.max_iterations = kIterations + (starts.size() > 1 ? kMoreIterations : 0),
                       .tolerance = 1e-4};
  InverseDepthReport best;
  InverseDepthState best_state;
  for (const Rigid3& start : starts) {
    InverseDepthState state = made.StateOf(window_);
    state.poses[newest] = start;
    InverseDepthReport report = solver_.Minimize(made.problem, options, state, true);
    if (&start != &starts.front() && !(report.solver.cost < best.solver.cost)) continue;
    best = std::move(report);
    best_state = std::move(state);
  }
  if (best_state.poses.empty()) return;
  made.Apply(best_state, window_);
  for (size_t k = 0; k < best.variances.size(); ++k) {
    WindowPoint& point = window_.points[made.points[k]];
    point.variance = best.variances[k];
    CompareWithParallax(window_.median_inverse_depth, point);
  }
  const Eigen::Index n = best.information.rows();
  if (n > 0) {
    best.information.diagonal().array() += 1e-9;
    const auto factor = best.information.ldlt();
    if (window_.inertial) {
      constexpr Eigen::Index kOnes = InertialVector::RowsAtCompileTime;
      imu_.SetCovariance(
          factor.solve(Eigen::MatrixXd::Identity(n, n).rightCols<kOnes>()).bottomRows<kOnes>(),
          window_);
    }
    covariance_ = factor.solve(Eigen::MatrixXd::Identity(n, n).middleCols(6 * newest, 6))
                      .middleRows(6 * newest, 6);
    scale_variance_ =
        best.scale.variance + best.scale.by_poses.dot(factor.solve(best.scale.by_poses));
  }
}

}  // namespace oaslam
