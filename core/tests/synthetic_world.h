#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "cameras.h"
#include "oaslam/features/features.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/map/map.h"
#include "oaslam/util/rng.h"

// A world of points with repeatable descriptors, seen by cameras on an arc around it: for tests and
// benchmarks.
namespace oaslam::synthetic {

struct WorldOptions {
  int points = 800;
  int cameras = 8;
  double arc_deg = 60;  // angle covered by the cameras, which look at the centre
  double radius = 3;    // of the arc; the points fill 4 x 2.4 x 2 around the centre
  uint64_t seed = 1;
  double farthest = 1e9;  // from which a point may be seen at octave 0
};

struct World {
  Camera camera = kCamera;
  std::vector<Eigen::Vector3d> points;
  std::vector<Descriptor> descriptors;  // per point
  std::vector<double> max_distance;     // per point: seen at octave 0 from there
  std::vector<float> angles_rad;        // per point
  std::vector<Rigid3> cam_from_world;
};

inline Descriptor RandomDescriptor(Rng& rng) {
  return {rng.Next(), rng.Next(), rng.Next(), rng.Next()};
}

inline Rigid3 PoseOnArc(const WorldOptions& options, double angle_deg) {
  const double a = angle_deg * std::numbers::pi / 180;
  return LookAt({options.radius * std::sin(a), -options.radius * std::cos(a), 0.8}, {0, 0, 0});
}

// What an odometry without errors tells of an image; in the frame of the world.
inline std::shared_ptr<const FrameMotion> TrueMotion(int image, const Rigid3& cam_from_world,
                                                     int run = 0) {
  FrameMotion motion;
  motion.run = run;
  motion.image = image;
  motion.cam_from_odom = cam_from_world;
  motion.is_keyframe = true;
  return std::make_shared<const FrameMotion>(std::move(motion));
}

inline World MakeWorld(const WorldOptions& options) {
  Rng rng(options.seed);
  World world;
  for (int i = 0; i < options.points; ++i) {
    world.points.emplace_back(rng.Uniform(-2, 2), rng.Uniform(-1.2, 1.2), rng.Uniform(-1, 1));
    world.descriptors.push_back(RandomDescriptor(rng));
    world.max_distance.push_back(
        std::min(options.farthest, options.radius * std::pow(1.2, rng.Uniform(0, 4))));
    world.angles_rad.push_back(static_cast<float>(rng.Uniform(0, 2 * std::numbers::pi)));
  }
  for (int k = 0; k < options.cameras; ++k)
    world.cam_from_world.push_back(PoseOnArc(
        options, options.cameras == 1
                     ? 0
                     : options.arc_deg * (static_cast<double>(k) / (options.cameras - 1) - 0.5)));
  return world;
}

// Each half has every second point: they are two scenes in one place, as if each were hidden while
// the other is seen.
inline std::array<World, 2> HalvesOf(const World& world) {
  std::array<World, 2> halves;
  for (World& half : halves) half.camera = world.camera;
  for (size_t i = 0; i < world.points.size(); ++i) {
    World& half = halves[i % 2];
    half.points.push_back(world.points[i]);
    half.descriptors.push_back(world.descriptors[i]);
    half.max_distance.push_back(world.max_distance[i]);
    half.angles_rad.push_back(world.angles_rad[i]);
  }
  return halves;
}

// An odometry with this unit knows these depths of the points in front of a camera.
inline std::vector<FrameMotion::KnownDepth> DepthsFrom(const World& world,
                                                       const Rigid3& cam_from_world, double unit) {
  std::vector<FrameMotion::KnownDepth> depths;
  for (const Eigen::Vector3d& point : world.points) {
    const Eigen::Vector3d x = cam_from_world * point;
    if (x.z() > 0)
      depths.push_back(
          {ProjectIdeal(world.camera, x).cast<float>(), static_cast<float>(unit / x.z())});
  }
  return depths;
}

struct ViewOptions {
  double noise_px = 0.5;  // at octave 0; grows with the octave
  int flipped_bits = 12;  // of 256, per view
  double missed = 0.1;    // share of visible points without a key point
  int clutter = 50;       // key points that show no point
};

struct View {
  std::shared_ptr<const Camera> camera;
  std::shared_ptr<const Features> features;
  std::vector<int> point_of_keypoint;  // -1: clutter
};

inline View MakeView(const World& world, const Rigid3& cam_from_world, const ViewOptions& options,
                     Rng& rng) {
  auto features = std::make_shared<Features>();
  features->bounds = IdealImageBounds(world.camera);
  View view{std::make_shared<const Camera>(world.camera), {}, {}};
  const auto add = [&](const Eigen::Vector2d& px, float angle, int octave,
                       const Descriptor& descriptor, int point) {
    features->keypoints.push_back({px.cast<float>(), angle, static_cast<uint8_t>(octave)});
    features->descriptors.push_back(descriptor);
    view.point_of_keypoint.push_back(point);
  };
  for (size_t i = 0; i < world.points.size(); ++i) {
    const Eigen::Vector3d x = cam_from_world * world.points[i];
    if (x.z() < 0.1 || rng.Uniform(0, 1) < options.missed) continue;
    const int octave = features->pyramid.PredictLevel(x.norm(), world.max_distance[i]);
    const double sigma = options.noise_px * features->pyramid.scale[octave];
    const Eigen::Vector2d px =
        ProjectIdeal(world.camera, x) + Eigen::Vector2d(rng.Gaussian(sigma), rng.Gaussian(sigma));
    if (px.x() < 0 || px.y() < 0 || px.x() >= world.camera.width || px.y() >= world.camera.height)
      continue;
    Descriptor descriptor = world.descriptors[i];
    for (int b = 0; b < options.flipped_bits; ++b) {
      const int bit = rng.Index(256);
      descriptor[bit / 64] ^= uint64_t{1} << (bit % 64);
    }
    add(px, world.angles_rad[i], octave, descriptor, static_cast<int>(i));
  }
  for (int i = 0; i < options.clutter; ++i)
    add({rng.Uniform(0, world.camera.width), rng.Uniform(0, world.camera.height)},
        static_cast<float>(rng.Uniform(0, 2 * std::numbers::pi)),
        rng.Index(features->pyramid.levels), RandomDescriptor(rng), -1);
  features->BuildGrid();
  view.features = features;
  return view;
}

// The image is one of a video of 30 Hz.
inline Frame MakeFrame(const View& view, int index = 0) {
  return {index, index / 30.0, view.camera, view.features, {}};
}

// The same features with their descriptors as the learned ones, and chance as ORB's.
inline std::shared_ptr<const Features> KnownByLearned(const Features& features, Rng& rng) {
  auto changed = std::make_shared<Features>(features);
  changed->learned = {{}, features.descriptors};
  for (int k = 0; k < features.size(); ++k) {
    changed->learned.keypoints.push_back(static_cast<uint16_t>(k));
    changed->descriptors[k] = RandomDescriptor(rng);
  }
  return changed;
}

struct MapOptions {
  ViewOptions view{};
  double position_noise = 0;     // of landmarks, world units
  double translation_noise = 0;  // of keyframes but the first
  double rotation_noise_rad = 0;
  uint64_t seed = 2;
};

// The motion exp(noise) applied on the left.
inline Rigid3 Disturb(const Rigid3& pose, double translation_sigma, double rotation_sigma_rad,
                      Rng& rng) {
  const Eigen::Vector3d w(rng.Gaussian(rotation_sigma_rad), rng.Gaussian(rotation_sigma_rad),
                          rng.Gaussian(rotation_sigma_rad));
  const Eigen::Vector3d t(rng.Gaussian(translation_sigma), rng.Gaussian(translation_sigma),
                          rng.Gaussian(translation_sigma));
  const double angle = w.norm();
  const Eigen::Quaterniond turn = angle > 0
                                      ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, w / angle))
                                      : Eigen::Quaterniond::Identity();
  return Rigid3(turn, t) * pose;
}

struct MappedWorld {
  Map map;                                    // a keyframe per camera of the world, ids 0, 1, ...
  std::vector<LandmarkId> landmark_of_point;  // invalid where seen by fewer than two cameras

  // There is one for each key point, which is invalid where it shows none.
  std::vector<LandmarkId> LandmarksIn(const View& view) const {
    std::vector<LandmarkId> landmarks;
    for (const int point : view.point_of_keypoint)
      landmarks.push_back(point < 0 ? LandmarkId() : landmark_of_point[point]);
    return landmarks;
  }
};

inline Map EmptyMap(const Camera& camera = kCamera) {
  Map map;
  map.cameras = {camera};
  return map;
}

// It has so many key points, of which nothing is known.
inline Keyframe BlankKeyframe(const Rigid3& cam_from_world, size_t keypoints = 0) {
  auto features = std::make_shared<Features>();
  features->bounds = IdealImageBounds(kCamera);
  features->keypoints.resize(keypoints);
  features->descriptors.resize(keypoints);
  features->BuildGrid();
  Keyframe keyframe;
  keyframe.cam_from_world = cam_from_world;
  keyframe.features = features;
  keyframe.landmarks.resize(keypoints);
  return keyframe;
}

// The landmark has these observations.
inline LandmarkId AddLandmark(Map& map, const Eigen::Vector3d& position,
                              const std::vector<Observation>& seen) {
  const LandmarkId id = map.AddLandmark(position, seen.front().keyframe);
  for (const Observation& o : seen) map.AddObservation(id, o.keyframe, o.keypoint);
  map.UpdateLandmark(id);
  return id;
}

// Takes away what keyframes from `first` on see of a landmark, which is erased where one or none is
// left.
inline std::vector<Observation> TakeObservations(Map& map, LandmarkId id, uint32_t first) {
  std::vector<Observation> taken;
  for (const Observation& o : map.landmarks.At(id).observations)
    if (o.keyframe.value >= first) taken.push_back(o);
  for (const Observation& o : taken) map.EraseObservation(id, o.keyframe);
  return taken;
}

// They are in the order of the keyframes' ids.
inline std::vector<Rigid3> KeyframePoses(const Map& map) {
  std::vector<Rigid3> poses;
  map.keyframes.ForEach(
      [&](KeyframeId, const Keyframe& keyframe) { poses.push_back(keyframe.cam_from_world); });
  return poses;
}

// A consistent map of the world: every point seen by two cameras or more is a landmark.
inline MappedWorld MakeMap(const World& world, const MapOptions& options) {
  Rng rng(options.seed);
  MappedWorld result{EmptyMap(world.camera), {}};
  Map& map = result.map;
  std::vector<std::vector<Observation>> seen(world.points.size());
  for (uint32_t k = 0; k < world.cam_from_world.size(); ++k) {
    const View view = MakeView(world, world.cam_from_world[k], options.view, rng);
    Keyframe keyframe;
    keyframe.frame_index = static_cast<int>(10 * k);
    keyframe.timestamp = k;
    keyframe.cam_from_world = k == 0 ? world.cam_from_world[k]
                                     : Disturb(world.cam_from_world[k], options.translation_noise,
                                               options.rotation_noise_rad, rng);
    keyframe.features = view.features;
    keyframe.landmarks.resize(view.features->keypoints.size());
    map.keyframes.Insert(KeyframeId(k), std::move(keyframe));
    for (uint32_t i = 0; i < view.point_of_keypoint.size(); ++i)
      if (view.point_of_keypoint[i] >= 0)
        seen[view.point_of_keypoint[i]].push_back({KeyframeId(k), i});
  }
  result.landmark_of_point.resize(world.points.size());
  for (size_t i = 0; i < world.points.size(); ++i) {
    if (seen[i].size() < 2) continue;
    const Eigen::Vector3d noise(rng.Gaussian(options.position_noise),
                                rng.Gaussian(options.position_noise),
                                rng.Gaussian(options.position_noise));
    result.landmark_of_point[i] = AddLandmark(map, world.points[i] + noise, seen[i]);
  }
  for (uint32_t k = 0; k < world.cam_from_world.size(); ++k) map.UpdateCovisibility(KeyframeId(k));
  return result;
}

}  // namespace oaslam::synthetic
