#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "oaslam/geometry/similarity.h"
#include "oaslam/objects/association.h"
#include "object_film.h"
#include "synthetic_world.h"

// A building of any size: a ramp that winds up a round tower, one storey a turn. The camera walks
// up and looks at the outer wall, on which there are points and, here and there, desks with
// objects. For benchmarks of how costs grow with the map.
namespace oaslam::synthetic {

struct BuildingOptions {
  int keyframes = 100;
  int objects = 20;  // in desks of kObjectsOfADesk, evenly along the walk
  // The ramp is level and ends where it begins, with the drift of a long walk: the last keyframes
  // see the first wall again, as landmarks of their own in a wrong place.
  bool is_loop = false;
  bool is_described = false;  // every third landmark, as if learned descriptors were those of ORB
};

class Building {
 public:
  static constexpr int kObjectsOfADesk = 10, kFramesPerKeyframe = 10;
  static constexpr double kInterval = 1.0 / 30;  // seconds between images

  explicit Building(const BuildingOptions& options)
      : options_(options),
        radius_(options.is_loop ? kStep * (options.keyframes - kOverlap) / (2 * std::numbers::pi)
                                : kRadius) {
    MakeWall();
    MakeDesks();
    MakeMap();
    MakeObjects();
    if (options.is_loop) Drift();
    // As the mapper does (PackSettledKeyframes).
    for (int k = 0; k + 500 < options.keyframes; ++k)
      map_.DropFreeKeypoints(KeyframeId(static_cast<uint32_t>(k)));
  }

  const Map& map() const { return map_; }

  // The true pose of the camera after so many steps; a step is the distance between keyframes.
  Rigid3 PoseAt(double steps) const {
    const double turn = steps * kStep / radius_;
    const Eigen::Vector3d out(std::cos(turn), std::sin(turn), 0);
    const Eigen::Vector3d center = radius_ * out + Height(turn) * Eigen::Vector3d::UnitZ();
    return LookAt(center, center + out);
  }

  static void DescribeEveryThird(Keyframe& keyframe) {
    Features features = *keyframe.features;
    for (size_t k = 0; k < features.keypoints.size(); k += 3) {
      if (!keyframe.landmarks[k].IsValid()) continue;
      features.learned.keypoints.push_back(static_cast<uint16_t>(k));
      features.learned.descriptors.push_back(features.descriptors[k]);
    }
    keyframe.learned_depths.assign(features.learned.keypoints.size(), 0);
    keyframe.features = std::make_shared<const Features>(std::move(features));
  }

  // The camera's view from there: key points, matched landmarks and detections.
  TrackedFrame FrameAt(double steps, Rng& rng) const {
    const auto [view, first] = ViewAt(steps, rng);
    TrackedFrame tracked;
    tracked.frame.index = static_cast<int>(kFramesPerKeyframe * steps);
    tracked.frame.timestamp = tracked.frame.index * kInterval;
    tracked.frame.camera = view.camera;
    tracked.frame.features = view.features;
    tracked.cam_from_world = PoseAt(steps);
    tracked.reference = KeyframeId(static_cast<uint32_t>(
        std::clamp(std::lround(steps), 0L, static_cast<long>(options_.keyframes - 1))));
    tracked.cam_from_reference =
        tracked.cam_from_world * map_.keyframes.At(tracked.reference).cam_from_world.Inverse();
    for (const int point : view.point_of_keypoint)
      tracked.landmarks.push_back(point < 0 ? LandmarkId() : landmark_of_point_[first + point]);
    tracked.inliers = static_cast<int>(
        std::ranges::count_if(tracked.landmarks, [](LandmarkId id) { return id.IsValid(); }));
    std::vector<TrueObject> near;
    for (size_t i = 0; i < objects_.size(); ++i)
      if (std::abs(object_steps_[i] - steps) < kInView) near.push_back(objects_[i]);
    tracked.frame.detections = Detect(near, tracked.cam_from_world, world_.camera, {}, rng);
    return tracked;
  }

  // The step at which the camera faces the middle of the desk nearest to this step.
  double DeskNear(double steps) const {
    const double spacing = DeskSpacing();
    return (std::floor(steps / spacing) + 0.5) * spacing;
  }

 private:
  static constexpr double kStep = 0.7, kRadius = 12, kStorey = 4, kWall = 3, kPointsPerMetre = 120;
  static constexpr double kInView = 5;  // steps; covers more than half of the wall in an image
  static constexpr int kKeypoints = 1000, kOverlap = 12;

  double Height(double turn) const {
    return options_.is_loop ? 0 : kStorey * turn / (2 * std::numbers::pi);
  }
  double DeskSpacing() const {
    return static_cast<double>(options_.keyframes) /
           std::max(1, options_.objects / kObjectsOfADesk);
  }

  Eigen::Vector3d OnWall(double steps, double across, double height, double depth) const {
    const double turn = steps * kStep / radius_ + across / (radius_ + kWall);
    return {(radius_ + depth) * std::cos(turn), (radius_ + depth) * std::sin(turn),
            Height(turn) + height};
  }

  void MakeWall() {
    Rng rng(1);
    const double steps = options_.is_loop ? options_.keyframes - kOverlap : options_.keyframes;
    const double metre = kStep * (radius_ + kWall) / radius_;  // a metre of wall, in steps
    const int margin = options_.is_loop ? 0 : static_cast<int>(kInView);
    points_per_step_ = metre * kPointsPerMetre;
    const int count = static_cast<int>((steps + 2 * margin) * points_per_step_);
    for (int i = 0; i < count; ++i) {
      const double at = i / points_per_step_ - margin;
      world_.points.push_back(
          OnWall(at, 0, rng.Uniform(-1.3, 1.3), kWall + rng.Uniform(-0.5, 0.5)));
      world_.descriptors.push_back(RandomDescriptor(rng));
      world_.max_distance.push_back(kWall * std::pow(1.2, rng.Uniform(0, 4)));
      world_.angles_rad.push_back(0);
    }
    first_step_ = -margin;
    if (!options_.is_loop) return;
    const auto again = static_cast<size_t>((kOverlap + 2 * kInView) * points_per_step_);
    for (size_t i = 0; i < again; ++i) {
      world_.points.push_back(world_.points[i]);
      world_.descriptors.push_back(world_.descriptors[i]);
      world_.max_distance.push_back(world_.max_distance[i]);
      world_.angles_rad.push_back(0);
    }
  }

  void MakeDesks() {
    Rng rng(2);
    for (int i = 0; i < options_.objects; ++i) {
      const double at = (i / kObjectsOfADesk + 0.5) * DeskSpacing();
      const int category = i % 6;
      const double size = 0.05 + 0.02 * category;
      const int place = i % kObjectsOfADesk;
      TrueObject object = Upright(
          category,
          OnWall(at, -1.4 + 0.31 * place, rng.Uniform(-0.8, 0.8), kWall - rng.Uniform(0.2, 0.8)),
          {size, size * rng.Uniform(0.7, 1), size});
      objects_.push_back(object);
      object_steps_.push_back(at);
    }
  }

  // The view from there, and the first point that it may show.
  std::pair<View, size_t> ViewAt(double steps, Rng& rng) const {
    World slice;
    slice.camera = world_.camera;
    const auto index = [&](double at) {
      return static_cast<size_t>(std::clamp((at - first_step_) * points_per_step_, 0.0,
                                            static_cast<double>(world_.points.size())));
    };
    const size_t begin = index(steps - kInView), end = index(steps + kInView);
    const auto part = [&](const auto& all) {
      return std::remove_cvref_t<decltype(all)>(all.begin() + static_cast<std::ptrdiff_t>(begin),
                                                all.begin() + static_cast<std::ptrdiff_t>(end));
    };
    slice.points = part(world_.points);
    slice.descriptors = part(world_.descriptors);
    slice.max_distance = part(world_.max_distance);
    slice.angles_rad = part(world_.angles_rad);
    ViewOptions options;
    options.clutter = kKeypoints / 2;
    return {MakeView(slice, PoseAt(steps), options, rng), begin};
  }

  void MakeMap() {
    Rng rng(3);
    map_ = EmptyMap(world_.camera);
    map_.up = Eigen::Vector3d::UnitZ();
    std::vector<std::vector<Observation>> seen(world_.points.size());
    for (int k = 0; k < options_.keyframes; ++k) {
      const KeyframeId id(static_cast<uint32_t>(k));
      const auto [view, first] = ViewAt(k, rng);
      Keyframe keyframe;
      keyframe.frame_index = kFramesPerKeyframe * k;
      keyframe.timestamp = keyframe.frame_index * kInterval;
      keyframe.cam_from_world = PoseAt(k);
      keyframe.features = view.features;
      keyframe.landmarks.resize(view.features->keypoints.size());
      map_.keyframes.Insert(id, std::move(keyframe));
      for (uint32_t i = 0; i < view.point_of_keypoint.size(); ++i)
        if (view.point_of_keypoint[i] >= 0)
          seen[first + static_cast<size_t>(view.point_of_keypoint[i])].push_back({id, i});
    }
    landmark_of_point_.resize(world_.points.size());
    for (size_t i = 0; i < world_.points.size(); ++i) {
      if (seen[i].size() < 2) continue;
      const LandmarkId id = AddLandmark(map_, world_.points[i], seen[i]);
      map_.landmarks.MutableAt(id).visible = map_.landmarks.MutableAt(id).found = 50;
      landmark_of_point_[i] = id;
    }
    if (options_.is_described)
      for (const KeyframeId id : map_.keyframes.Ids())
        DescribeEveryThird(map_.keyframes.MutableAt(id));
    for (const KeyframeId id : map_.keyframes.Ids()) map_.UpdateCovisibility(id);
  }

  void MakeObjects() {
    Rng rng(4);
    for (uint32_t i = 0; i < objects_.size(); ++i) {
      Object object = WellMappedObject(objects_[i]);
      object.mean_iou = 0.95;
      for (int k = std::max(0, static_cast<int>(object_steps_[i] - kInView));
           k < std::min(options_.keyframes, static_cast<int>(object_steps_[i] + kInView)); ++k)
        for (const ObjectDetection& d : Detect({objects_[i]}, PoseAt(k), world_.camera, {}, rng))
          object.observations.push_back({kFramesPerKeyframe * k,
                                         KeyframeId(static_cast<uint32_t>(k)),
                                         {},
                                         0,
                                         d.box,
                                         d.score,
                                         d.truncated});
      object.total_observations = static_cast<int>(object.observations.size()) * kFramesPerKeyframe;
      object.evidence = object.total_observations;
      object.last_seen_frame =
          object.observations.empty() ? 0 : object.observations.back().frame_index;
      AddObject(map_, std::move(object));
    }
  }

  // Turns and scales the walk, increasingly.
  void Drift() {
    const auto at = [&](KeyframeId id) {
      const double share = static_cast<double>(id.value) / options_.keyframes;
      return Similarity(
          1 + 0.03 * share,
          Eigen::Quaterniond(Eigen::AngleAxisd(0.02 * share, Eigen::Vector3d::UnitZ())),
          Eigen::Vector3d(0, 0, 0.5 * share));
    };
    for (const LandmarkId id : map_.landmarks.Ids()) {
      Landmark& landmark = map_.landmarks.MutableAt(id);
      landmark.position = at(landmark.observations.front().keyframe) * landmark.position;
    }
    for (const KeyframeId id : map_.keyframes.Ids()) {
      Rigid3& pose = map_.keyframes.MutableAt(id).cam_from_world;
      pose = (Similarity(pose) * at(id).Inverse()).AsPose();
    }
    for (const LandmarkId id : map_.landmarks.Ids()) map_.UpdateLandmark(id);
  }

  BuildingOptions options_;
  double radius_;
  World world_;
  std::vector<TrueObject> objects_;
  std::vector<double> object_steps_;
  std::vector<LandmarkId> landmark_of_point_;
  double points_per_step_ = 0, first_step_ = 0;
  Map map_;
};

}  // namespace oaslam::synthetic
