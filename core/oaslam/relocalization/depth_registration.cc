#include "oaslam/relocalization/depth_registration.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "oaslam/camera_file.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/util/bad_input.h"
#include "oaslam/util/log.h"
#include "oaslam/util/median.h"

namespace oaslam {
namespace {

// Every how manyth pixel of a row or a column is used, of an image of this width: more pixels cost
// time, and tell no more of a surface.
int StepOf(int width) {
  constexpr int kUsed = 320;
  return std::max(1, (width + kUsed / 2) / kUsed);
}

// Metres; 0 where nothing was measured.
float MetresAt(const DepthImage& depth, int x, int y) {
  if (depth.image.type() == CV_16UC1)
    return static_cast<float>(depth.image.at<uint16_t>(y, x) * depth.unit);
  const float z = depth.image.at<float>(y, x);
  return std::isfinite(z) && z > 0 ? z : 0;
}

float InRange(const DepthModel& model, float z) {
  return z >= model.nearest && z <= model.farthest ? z : 0;
}

std::shared_ptr<const DepthMap> Thinned(const DepthImage& depth, const Camera& camera) {
  const int step = StepOf(depth.image.cols), width = depth.image.cols / step,
            height = depth.image.rows / step;
  std::vector<float> z;
  z.reserve(static_cast<size_t>(width) * height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      z.push_back(InRange(depth.model, MetresAt(depth, x * step + step / 2, y * step + step / 2)));
  return std::make_shared<const DepthMap>(width, height, std::move(z), camera.width, camera.height,
                                          depth.model.floor, depth.model.quadratic);
}

void CheckModel(const DepthModel& m) {
  const bool has_noise = std::isfinite(m.floor) && std::isfinite(m.quadratic) && m.floor >= 0 &&
                         m.quadratic >= 0 && m.floor + m.quadratic > 0;
  if (!has_noise)
    throw BadInput("depth: noise {:.6g} m + {:.6g} z^2, allowed: not negative, and not both 0",
                   m.floor, m.quadratic);
  if (!(m.nearest >= 0 && m.nearest < m.farthest && std::isfinite(m.farthest)))
    throw BadInput("depth: range {:.6g} to {:.6g} m, allowed: 0 or more, ascending and finite",
                   m.nearest, m.farthest);
}

}  // namespace

void CheckDepth(const DepthImage& depth, const Camera& camera) {
  const cv::Mat& image = depth.image;
  if (image.empty()) throw InputError("depth: image without pixels");
  if (image.type() != CV_16UC1 && image.type() != CV_32FC1)
    throw InputError("depth: image is neither of 16 bit unsigned nor of 32 bit float");
  constexpr double kMostUnit = 1;  // m
  if (!(depth.unit > 0 && depth.unit <= kMostUnit))
    throw BadInput("depth: unit {:.6g} m, allowed: above 0 to {}", depth.unit, kMostUnit);
  CheckModel(depth.model);
  if (depth.camera) {
    CheckCalibration(*depth.camera, "depth camera");
    if (depth.camera->width != image.cols || depth.camera->height != image.rows)
      throw BadInput("depth: image of {}x{} pixels, the depth camera's calibration is for {}x{}",
                     image.cols, image.rows, depth.camera->width, depth.camera->height);
    constexpr double kMostApart = 1;  // m
    if (!depth.cam_from_depth.IsValid() || depth.cam_from_depth.translation.norm() > kMostApart)
      throw BadInput("depth: T_cam_depth: must be a rigid motion of at most {} m", kMostApart);
    return;
  }
  constexpr double kMostOther = 0.03;  // sensors of 224 x 172 pixels are beside images of 4:3
  const double shape = static_cast<double>(image.cols) / image.rows,
               asked = static_cast<double>(camera.width) / camera.height;
  if (std::abs(shape / asked - 1) > kMostOther)
    throw BadInput(
        "depth: image of {}x{} pixels has another shape than the camera's, {}x{}: a registered "
        "depth shows the same view, another needs the depth camera's calibration",
        image.cols, image.rows, camera.width, camera.height);
}

std::shared_ptr<const DepthMap> DepthRegistration::Register(const DepthImage& depth,
                                                            const Camera& camera) {
  CheckDepth(depth, camera);
  CheckRange(depth);
  return depth.camera ? Splat(depth, camera) : Thinned(depth, camera);
}

void DepthRegistration::CheckRange(const DepthImage& depth) {
  constexpr int kImages = 10;
  constexpr double kHardlyAny = 0.1;
  constexpr int kSide = 24;  // points that are looked at, in each direction
  if (strange_images_ >= kImages) return;
  std::vector<double> measured;
  int in_range = 0;
  for (int i = 0; i < kSide; ++i)
    for (int j = 0; j < kSide; ++j) {
      const float z = MetresAt(depth, depth.image.cols * (2 * j + 1) / (2 * kSide),
                               depth.image.rows * (2 * i + 1) / (2 * kSide));
      if (z <= 0) continue;
      measured.push_back(z);
      in_range += InRange(depth.model, z) > 0;
    }
  constexpr size_t kLeast = 50;
  const bool is_strange =
      measured.size() >= kLeast && in_range < kHardlyAny * static_cast<double>(measured.size());
  strange_images_ = is_strange ? strange_images_ + 1 : 0;
  if (strange_images_ < kImages) return;
  Log(LogLevel::kWarning,
      "depth: {} of {} depths are outside of {:.6g} to {:.6g} m, the median is {:.4g} m: its unit "
      "is probably wrong{}",
      measured.size() - in_range, measured.size(), depth.model.nearest, depth.model.farthest,
      Median(measured),
      depth.image.type() == CV_16UC1 ? fmt::format(" ({:.6g} m)", depth.unit) : " (not metres)");
}

void DepthRegistration::UseCameras(const DepthImage& depth, const Camera& camera) {
  if (camera != camera_) most_tangent_ = static_cast<float>(std::tan(MaxLensAngle(camera)));
  camera_ = camera;
  const Camera& depth_camera = *depth.camera;
  const Rigid3::Rotation& rotation = depth.cam_from_depth.rotation;
  if (depth_camera == depth_camera_ && rotation.coeffs() == rotation_.coeffs()) return;
  depth_camera_ = depth_camera;
  rotation_ = rotation;
  rays_.clear();
  const int step = StepOf(depth_camera.width);
  const Eigen::Vector3d no_ray = Eigen::Vector3d::Constant(NAN);
  for (int y = step / 2; y < depth_camera.height; y += step)
    for (int x = step / 2; x < depth_camera.width; x += step)
      rays_.push_back((rotation * depth_camera.Lift({x, y}).value_or(no_ray)).cast<float>());
}

// Each pixel of the depth camera becomes one of the map; of two surfaces the nearer one is seen.
std::shared_ptr<const DepthMap> DepthRegistration::Splat(const DepthImage& depth,
                                                         const Camera& camera) {
  // Larger pixels than those of the depth image, so that no hole is left between them.
  constexpr double kLarger = 1.25;
  const Camera& from = *depth.camera;
  UseCameras(depth, camera);
  const int step = StepOf(from.width);
  const double scale = std::min(1.0, from.fx / (camera.fx * step * kLarger));
  const int width = std::max(1, static_cast<int>(std::lround(camera.width * scale))),
            height = std::max(1, static_cast<int>(std::lround(camera.height * scale)));
  const double x_scale = static_cast<double>(width) / camera.width,
               y_scale = static_cast<double>(height) / camera.height;
  // The pinhole camera of the map's pixels, each of which reaches from its number to the next.
  const auto fx = static_cast<float>(camera.fx * x_scale),
             fy = static_cast<float>(camera.fy * y_scale),
             cx = static_cast<float>((camera.cx + 0.5) * x_scale),
             cy = static_cast<float>((camera.cy + 0.5) * y_scale);
  const Eigen::Vector3f translation = depth.cam_from_depth.translation.cast<float>();
  const bool is_distorted = camera.HasDistortion() || camera.model == LensModel::kFisheye;
  std::vector<float> z(static_cast<size_t>(width) * height);
  size_t next = 0;
  for (int y = step / 2; y < from.height; y += step)
    for (int x = step / 2; x < from.width; x += step) {
      const Eigen::Vector3f& ray = rays_[next++];
      const float measured = InRange(depth.model, MetresAt(depth, x, y));
      const Eigen::Vector3f there = measured * ray + translation;
      if (measured <= 0 || !(there.z() > 0)) continue;
      const float inverse_z = 1 / there.z();
      float column = fx * there.x() * inverse_z + cx, row = fy * there.y() * inverse_z + cy;
      if (is_distorted) {
        if (there.head<2>().norm() > most_tangent_ * there.z()) continue;
        const Eigen::Vector2d px = Distort(camera, ProjectIdeal(camera, there.cast<double>()));
        column = static_cast<float>((px.x() + 0.5) * x_scale);
        row = static_cast<float>((px.y() + 0.5) * y_scale);
      }
      if (!(column >= 0 && row >= 0 && column < static_cast<float>(width) &&
            row < static_cast<float>(height)))
        continue;
      float& seen = z[static_cast<size_t>(row) * width + static_cast<size_t>(column)];
      if (seen <= 0 || there.z() < seen) seen = there.z();
    }
  return std::make_shared<const DepthMap>(width, height, std::move(z), camera.width, camera.height,
                                          depth.model.floor, depth.model.quadratic);
}

}  // namespace oaslam
