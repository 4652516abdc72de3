#include "odometry_js.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "oaslam/features/orb_extractor.h"
#include "oaslam/geometry/angular_velocity_check.h"
#include "oaslam/geometry/camera_check.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/odometry/odometry.h"

struct OaslamOdometry {
  oaslam::Camera camera;
  std::string problem;
  std::unique_ptr<oaslam::Odometry> odometry;
  std::vector<uint8_t> grey, rgba;  // of the next image, in either
  std::vector<uint8_t> last;        // grey, of the last image that was processed
  std::vector<double> samples;      // of `columns` numbers each
  int columns = 4;
  std::vector<oaslam::AngularVelocity> angular_velocity;
  std::vector<oaslam::ImuSample> imu;  // instead of `angular_velocity`
  std::optional<double> last_s;
  OaslamEstimate estimate{};
  std::vector<float> points;
  std::vector<double> keyframes;
  std::unique_ptr<oaslam::OrbExtractor> extractor;  // made for the first features
  double lowest_scale = 1;
  std::vector<uint8_t> features;
};

namespace oaslam {
namespace {

// The image must be larger than what its pyramid mirrors at each edge.
std::string SizeProblem(const Camera& camera) {
  int width = camera.width, height = camera.height;
  for (; width > OdometryOptions().max_width; width = (width + 1) / 2) height = (height + 1) / 2;
  constexpr int kMost = 2 * GreyPyramid::kBorder;
  if (std::min(width, height) > kMost) return "";
  return fmt::format("images of {} x {} are too small: tracked at {} x {}, more than {} asked",
                     camera.width, camera.height, width, height, kMost);
}

// The weights of BT.601, in 1 / 32768.
void ToGrey(const std::vector<uint8_t>& rgba, std::vector<uint8_t>& grey) {
  for (size_t i = 0; i < grey.size(); ++i) {
    const uint8_t* p = rgba.data() + 4 * i;
    grey[i] = static_cast<uint8_t>((9798 * p[0] + 19235 * p[1] + 3735 * p[2] + 16384) >> 15);
  }
}

void TakeSamples(int count, OaslamOdometry& o) {
  o.angular_velocity.clear();
  o.imu.clear();
  const bool has_acceleration = o.columns == 7;
  for (int i = 0; i < count; ++i) {
    const double* s = o.samples.data() + static_cast<size_t>(o.columns) * i;
    const Eigen::Vector3d turn(s[1], s[2], s[3]);
    if (has_acceleration)
      o.imu.push_back({s[0], turn, {s[4], s[5], s[6]}});
    else
      o.angular_velocity.push_back({s[0], turn});
  }
}

// What is wrong with samples; an empty text where nothing is.
std::string SamplesProblem(const OaslamOdometry& o) {
  std::vector<AngularVelocity> rates = o.angular_velocity;
  for (const ImuSample& sample : o.imu) {
    std::string problem = ProblemOfAcceleration(sample.acceleration);
    if (!problem.empty()) return problem;
    rates.push_back({sample.timestamp, sample.angular_velocity});
  }
  const double* last = nullptr;
  for (const AngularVelocity& rate : rates) {
    std::string problem = ProblemOf(rate, last);
    if (!problem.empty()) return problem;
    last = &rate.timestamp;
  }
  return "";
}

// What is wrong with the input to `process`; an empty text where nothing is.
std::string InputProblem(const OaslamOdometry& o, double time_s) {
  if (!std::isfinite(time_s)) return "time stamp: must be finite";
  if (o.last_s && !(time_s > *o.last_s))
    return fmt::format("time stamp {:.6f} is not after the one before, {:.6f}", time_s, *o.last_s);
  return SamplesProblem(o);
}

void SetEstimate(const OdometryEstimate& from, OaslamEstimate& to) {
  const Rigid3& pose = from.cam_from_odom;
  Eigen::Map<Eigen::Vector4d>(to.rotation) = pose.rotation.coeffs();
  Eigen::Map<Eigen::Vector3d>(to.translation) = pose.translation;
  Eigen::Map<PoseCovariance>(to.covariance) = from.covariance;
  to.metres_per_unit = from.metres_per_unit;
  to.metre_sigma = from.metre_sigma;
  Eigen::Map<Eigen::Vector3d>(to.gravity) = from.gravity_in_cam.value_or(Eigen::Vector3d::Zero());
  to.state = static_cast<int32_t>(from.state);
  to.run = from.run;
  to.image = from.image;
  to.is_keyframe = from.is_keyframe;
  to.tracked = from.tracked;
  to.inliers = from.inliers;
}

void SetPoints(OaslamOdometry& o) {
  o.points.clear();
  for (const OdometryDepth& depth : o.odometry->Depths()) {
    const Eigen::Vector2d px =
        Distort(o.camera, ProjectIdeal(o.camera, depth.ray.homogeneous().eval()));
    for (const double value : {px.x(), px.y(), depth.inverse_depth})
      o.points.push_back(static_cast<float>(value));
  }
  o.estimate.points = static_cast<int32_t>(o.points.size() / 3);
}

void SetKeyframes(const OdometryEstimate& from, OaslamOdometry& o) {
  o.keyframes.clear();
  for (const auto& [image, cam_from_odom] : from.keyframes) {
    const Rigid3 pose = cam_from_odom.Inverse();
    const Eigen::Vector3d& p = pose.translation;
    const Eigen::Quaterniond& q = pose.rotation;
    o.keyframes.insert(o.keyframes.end(), {static_cast<double>(image), p.x(), p.y(), p.z(), q.x(),
                                           q.y(), q.z(), q.w()});
  }
  o.estimate.keyframes = static_cast<int32_t>(from.keyframes.size());
}

void Append(const void* data, size_t size, std::vector<uint8_t>& to) {
  const auto* bytes = static_cast<const uint8_t*>(data);
  to.insert(to.end(), bytes, bytes + size);
}

void SetFeatures(const Features& from, std::vector<uint8_t>& to) {
  to.clear();
  for (const Keypoint& k : from.keypoints) {
    const float values[] = {k.px.x(), k.px.y(), k.angle_rad};
    Append(values, sizeof(values), to);
  }
  for (const Keypoint& k : from.keypoints) to.push_back(k.octave);
  for (const Descriptor& d : from.descriptors) Append(d.data(), sizeof(d), to);
}

GreyImage LastImage(const OaslamOdometry& o) {
  return {o.last.data(), o.camera.width, o.camera.width, o.camera.height};
}

}  // namespace
}  // namespace oaslam

OaslamOdometry* oaslam_odometry_new(int is_fisheye, int width, int height, double fx, double fy,
                                    double cx, double cy, double k1, double k2, double k3,
                                    double k4, double k5, double seed) {
  auto* o = new OaslamOdometry;
  o->camera = {.model = is_fisheye ? oaslam::LensModel::kFisheye : oaslam::LensModel::kPinhole,
               .width = width,
               .height = height,
               .fx = fx,
               .fy = fy,
               .cx = cx,
               .cy = cy,
               .distortion = {k1, k2, k3, k4, k5}};
  o->problem = oaslam::ProblemOf(o->camera);
  if (o->problem.empty()) o->problem = oaslam::SizeProblem(o->camera);
  if (!o->problem.empty()) return o;
  o->odometry = std::make_unique<oaslam::Odometry>(o->camera, oaslam::OdometryOptions{},
                                                   static_cast<uint64_t>(seed));
  o->grey.resize(static_cast<size_t>(width) * height);
  o->last.resize(o->grey.size());
  return o;
}

const char* oaslam_odometry_problem(const OaslamOdometry* o) { return o->problem.c_str(); }

uint8_t* oaslam_odometry_image(OaslamOdometry* o) { return o->grey.data(); }

uint8_t* oaslam_odometry_rgba(OaslamOdometry* o) {
  o->rgba.resize(4 * o->grey.size());
  return o->rgba.data();
}

double* oaslam_odometry_samples(OaslamOdometry* o, int count, int columns) {
  o->columns = columns;
  o->samples.resize(static_cast<size_t>(columns) * count);
  return o->samples.data();
}

const OaslamEstimate* oaslam_odometry_process(OaslamOdometry* o, double time_s, int is_rgba,
                                              int samples) {
  oaslam::TakeSamples(samples, *o);
  o->problem = oaslam::InputProblem(*o, time_s);
  if (!o->problem.empty()) return nullptr;
  o->last_s = time_s;
  if (is_rgba)
    oaslam::ToGrey(o->rgba, o->last);
  else
    o->last = o->grey;
  const oaslam::OdometryEstimate estimate = o->odometry->Process(
      oaslam::LastImage(*o), time_s, {.angular_velocity = o->angular_velocity, .imu = o->imu});
  oaslam::SetEstimate(estimate, o->estimate);
  oaslam::SetKeyframes(estimate, *o);
  oaslam::SetPoints(*o);
  return &o->estimate;
}

const float* oaslam_odometry_points(const OaslamOdometry* o) { return o->points.data(); }

const double* oaslam_odometry_keyframes(const OaslamOdometry* o) { return o->keyframes.data(); }

int oaslam_odometry_features(OaslamOdometry* o, int count) {
  if (!o->extractor)
    o->extractor = std::make_unique<oaslam::OrbExtractor>(oaslam::FeaturesConfig{}, o->camera);
  const oaslam::Features features = o->extractor->Extract(oaslam::LastImage(*o), count);
  o->lowest_scale = features.pyramid.working_pixel();
  oaslam::SetFeatures(features, o->features);
  return features.size();
}

const uint8_t* oaslam_odometry_feature_bytes(const OaslamOdometry* o) { return o->features.data(); }

double oaslam_odometry_lowest_scale(const OaslamOdometry* o) { return o->lowest_scale; }

void oaslam_odometry_delete(OaslamOdometry* o) { delete o; }
