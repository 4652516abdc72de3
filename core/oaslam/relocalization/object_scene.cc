#include "oaslam/relocalization/object_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/degree.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/map/parts.h"

namespace oaslam {
namespace {

// The detections with the best scores that are used; the time grows with the number of triplets.
constexpr size_t kMaxDetections = 24;

SceneObject Prepare(ObjectId id, const Object& object) {
  SceneObject scene;
  scene.id = id;
  scene.category_id = object.category_id;
  scene.ellipsoid = object.ellipsoid;
  scene.scaled_axes = ScaledAxes(object.ellipsoid);
  scene.radius = std::cbrt(object.ellipsoid.half_axes.prod());
  scene.reach = object.ellipsoid.half_axes.maxCoeff();
  scene.covariance = &object.covariance;
  const Eigen::Vector3d axes = object.ellipsoid.half_axes.cwiseAbs2().cwiseProduct(
      object.covariance.diagonal().segment<3>(3));
  scene.variance = object.covariance.topLeftCorner<3, 3>().trace() / 3 + axes.mean();
  scene.detection_rate = std::clamp(object.detection_rate, 0.5, 0.97);
  return scene;
}

CameraAttitudes AttitudesOf(const Map& map, const Eigen::Vector3d& up) {
  constexpr size_t kEnough = 200;  // keyframes, evenly spaced; bounds the time
  const auto stride = static_cast<uint32_t>(map.keyframes.size() / kEnough + 1);
  CameraAttitudes attitudes{1e9, -1e9, 0};
  size_t count = 0;
  double side = 0, upright = 0;
  const uint32_t first = map.keyframes.empty() ? 0 : map.keyframes.First().value;
  for (uint32_t id = first; id < map.keyframes.Bound().value; id += stride) {
    const Keyframe* keyframe = map.keyframes.Find(KeyframeId(id));
    if (!keyframe) continue;
    const Eigen::Vector3d u = keyframe->cam_from_world.rotation * up;
    const double pitch = std::atan2(-u.z(), std::hypot(u.x(), u.y()));
    attitudes.min_pitch = std::min(attitudes.min_pitch, pitch);
    attitudes.max_pitch = std::max(attitudes.max_pitch, pitch);
    side += u.x();
    upright -= u.y();
    ++count;
  }
  if (count == 0) return {};
  attitudes.mean_roll = std::atan2(side, upright);
  return attitudes;
}

bool MayOverlapItsBoxes(const ObjectScene& scene, const SceneObject& object,
                        const Eigen::Vector3d& center) {
  return std::ranges::any_of(object.detections, [&](const LabelMatch& match) {
    return MayOverlap(scene.detections[match.detection].box, scene.camera, center, object.reach);
  });
}

// An object that a detection may show, and how well their labels agree (label_shares.h).
struct ObjectMatch {
  int object = 0;  // index into ObjectScene::objects
  double agreement = 0;
};

// Finds the objects that a detection may show by its labels.
class ObjectsByLabel {
 public:
  void Add(int object, const LabelsRef& labels) {
    const double norm = LabelNorm(labels);
    ForEachLabel(labels, [&](int category, double share) {
      objects_[category].push_back({object, share / norm});
    });
  }
  // Ascending by object.
  std::vector<ObjectMatch> MatchesOf(const ObjectDetection& detection) const {
    std::vector<ObjectMatch> found;
    const LabelsRef labels = LabelsOf(detection);
    const double norm = LabelNorm(labels);
    ForEachLabel(labels, [&](int category, double share) {
      const auto objects = objects_.find(category);
      if (objects == objects_.end()) return;
      for (const ObjectMatch& o : objects->second)
        found.push_back({o.object, share / norm * o.agreement});
    });
    std::ranges::stable_sort(found, {}, &ObjectMatch::object);
    std::vector<ObjectMatch> matches;
    for (const ObjectMatch& f : found)
      if (!matches.empty() && matches.back().object == f.object)
        matches.back().agreement += f.agreement;
      else
        matches.push_back(f);
    std::erase_if(matches, [](const ObjectMatch& m) { return !(m.agreement >= kLeastAgreement); });
    return matches;
  }

 private:
  // By class, with the share of that label, divided by the norm of all.
  std::map<int, std::vector<ObjectMatch>> objects_;
};

// Gives each object the detections that may show it, in `memory`. `matches`: by detection.
void AssignDetections(const std::vector<std::vector<ObjectMatch>>& matches,
                      std::vector<LabelMatch>& memory, std::vector<SceneObject>& objects) {
  std::vector<size_t> ends(objects.size());
  for (const auto& of_detection : matches)
    for (const ObjectMatch& match : of_detection) ++ends[match.object];
  std::partial_sum(ends.begin(), ends.end(), ends.begin());
  memory.resize(ends.empty() ? 0 : ends.back());
  std::vector<size_t> next(objects.size());
  for (size_t o = 0; o < objects.size(); ++o) {
    next[o] = o == 0 ? 0 : ends[o - 1];
    objects[o].detections = std::span(memory).subspan(next[o], ends[o] - next[o]);
  }
  for (size_t d = 0; d < matches.size(); ++d)
    for (const ObjectMatch& match : matches[d])
      memory[next[match.object]++] = {static_cast<int>(d), std::log(match.agreement)};
}

}  // namespace

// For any point of a ball of radius a around c, the coordinate x / z differs from that of c by at
// most a (1 + |c_x / c_z|) / (c_z - a).
bool MayOverlap(const Box& box, const Camera& camera, const Eigen::Vector3d& center, double reach) {
  if (center.z() + reach <= 0) return false;
  const double near = center.z() - reach;
  if (near <= 0) return true;
  const Eigen::Vector2d slope = center.head<2>() / center.z();
  const double x = camera.fx * slope.x() + camera.cx + kBoxFromPixel,
               y = camera.fy * slope.y() + camera.cy + kBoxFromPixel;
  const double dx = camera.fx * reach * (1 + std::abs(slope.x())) / near,
               dy = camera.fy * reach * (1 + std::abs(slope.y())) / near;
  return x + dx > box.x1 && x - dx < box.x2 && y + dy > box.y1 && y - dy < box.y2;
}

Eigen::Vector3d UpInCamera(double pitch, double roll) {
  return {std::sin(roll) * std::cos(pitch), -std::cos(roll) * std::cos(pitch), -std::sin(pitch)};
}

ObjectScene::ObjectScene(std::span<const ObjectDetection> all_detections,
                         const Camera& query_camera, const Map& map,
                         const RelocalizationConfig& config,
                         const std::optional<Eigen::Vector3d>& gravity_in_cam)
    : camera(query_camera), score(query_camera), image(query_camera), classes(map.classes) {
  objects.reserve(map.objects.size());
  spheres.reserve(map.objects.size());
  ObjectsByLabel objects_by_label;
  map.objects.ForEach([&](ObjectId id, const Object& object) {
    if (object.state != ObjectState::kMapped) return;
    objects_by_label.Add(static_cast<int>(objects.size()), LabelsOf(object));
    objects.push_back(Prepare(id, object));
    const Eigen::Vector3d& center = object.ellipsoid.center;
    spheres.emplace_back(center.x(), center.y(), center.z(), objects.back().reach);
  });
  for (const ObjectDetection& d : all_detections)
    if (d.score >= config.min_score && classes.IsMovable(d.category_id)) moving.push_back(d.box);
  std::vector<int> order;
  for (int i = 0; i < static_cast<int>(all_detections.size()); ++i)
    if (all_detections[i].score >= config.min_score && all_detections[i].box.Area() > 0)
      order.push_back(i);
  std::ranges::stable_sort(
      order, [&](int a, int b) { return all_detections[a].score > all_detections[b].score; });
  std::vector<std::vector<ObjectMatch>> matches;  // by detection
  for (const int i : order) {
    if (detections.size() == kMaxDetections) break;
    const ObjectDetection& d = all_detections[i];
    matches.push_back(objects_by_label.MatchesOf(d));
    if (matches.back().empty()) {
      matches.pop_back();
      continue;
    }
    const double size = SizeOf(d.box);
    detections.push_back({i, d.box, d.truncated, RayOf(camera, CenterPixel(d.box)), size,
                          std::sqrt(camera.fx * camera.fy) / (size / 2), d.surface});
    for (const ObjectMatch& match : matches.back())
      detections.back().objects.push_back(match.object);
  }
  AssignDetections(matches, label_matches_, objects);
  up = map.up;
  if (!up) return;
  attitudes = AttitudesOf(map, *up);
  if (gravity_in_cam && gravity_in_cam->norm() > 0) up_in_cam = -gravity_in_cam->normalized();
}

double ObjectScene::ScorePose(const Rigid3& cam_from_world, std::span<const int> scope) const {
  std::array<double, kMaxDetections> best{};
  const Eigen::Matrix3d rotation = cam_from_world.rotation.toRotationMatrix();
  const double focal_squared = camera.fx * camera.fy;
  for (const int o : scope) {
    const SceneObject& object = objects[o];
    if (object.detections.empty()) continue;
    const Eigen::Vector3d center = rotation * object.ellipsoid.center + cam_from_world.translation;
    if (center.z() <= 0 || !MayOverlapItsBoxes(*this, object, center)) continue;
    const OutlineConic outline = OutlineOf(center, rotation * object.scaled_axes);
    if (!IsInFront(center.z(), outline)) continue;
    const Box predicted = OutlineBox(outline, camera);
    const double variance = focal_squared * object.variance / (center.z() * center.z());
    for (const auto& [d, log_agreement] : object.detections) {
      const SceneDetection& detection = detections[d];
      if (predicted.x1 > detection.box.x2 || predicted.x2 < detection.box.x1 ||
          predicted.y1 > detection.box.y2 || predicted.y2 < detection.box.y1)
        continue;
      best[d] = std::max(
          best[d], log_agreement + score.WithCommonVariance(detection.box, detection.truncated,
                                                            predicted, variance));
    }
  }
  double sum = 0;
  for (size_t d = 0; d < detections.size(); ++d) sum += best[d];
  return sum;
}

bool ObjectScene::AreTogether(int object_a, int object_b) const {
  const SceneObject &a = objects[object_a], &b = objects[object_b];
  return BelongTogether(classes, a.category_id, a.ellipsoid, b.category_id, b.ellipsoid);
}

bool ObjectScene::IsPlausiblyHeld(const Eigen::Matrix3d& cam_from_world) const {
  // Wide, since guesses are coarse and the vertical has an error: 15 degrees from measured gravity,
  // 25 for the roll of a hand.
  static const double kCosMaxTilt = std::cos(15 * kDegree), kCosMaxRoll = std::cos(25 * kDegree);
  constexpr double kSteep = 0.9;  // sine of 64 degrees
  if (!up) return true;
  const Eigen::Vector3d u = cam_from_world * *up;
  if (up_in_cam) return u.dot(*up_in_cam) > kCosMaxTilt;
  // Roll is not defined when the camera looks straight up or down.
  if (std::abs(u.z()) > kSteep) return true;
  return u.x() * std::sin(attitudes.mean_roll) - u.y() * std::cos(attitudes.mean_roll) >
         kCosMaxRoll * std::hypot(u.x(), u.y());
}

}  // namespace oaslam
