#pragma once

#include <algorithm>

#include "oaslam/storage/map_file.h"
#include "oaslam/util/rng.h"

namespace oaslam {

struct RandomMapOptions {
  int keyframes = 8;
  int keypoints = 60;
  int landmarks = 120;
  int views = 4;  // observations of a landmark
  int objects = 4;
};

inline Rigid3 RandomPose(Rng& rng) {
  const Eigen::Quaterniond q(1, rng.Gaussian(0.3), rng.Gaussian(0.3), rng.Gaussian(0.3));
  return {q.normalized(), Eigen::Vector3d(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1))};
}

inline std::shared_ptr<const Features> RandomFeatures(int count, Rng& rng) {
  auto features = std::make_shared<Features>();
  features->pyramid = PyramidScales(7, 1.25);
  features->bounds = {-2.5, -1.25, 642, 481};
  for (int i = 0; i < count; ++i) {
    features->keypoints.push_back(
        {Eigen::Vector2d(rng.Uniform(0, 640), rng.Uniform(0, 480)).cast<float>(),
         static_cast<float>(rng.Uniform(0, 6)), static_cast<uint8_t>(rng.Index(7))});
    features->descriptors.push_back({rng.Next(), rng.Next(), rng.Next(), rng.Next()});
  }
  features->BuildGrid();
  return features;
}

inline Object RandomObject(const Map& map, Rng& rng) {
  Object object;
  object.category_id = rng.Index(80);
  if (rng.Index(2) == 0) object.name = "my \"own\" thing";
  object.state = static_cast<ObjectState>(rng.Index(3));
  object.ellipsoid = {Eigen::Vector3d(rng.Gaussian(1), rng.Gaussian(1), 4),
                      Eigen::Vector3d(0.2, 0.3, rng.Uniform(0.1, 0.4)), RandomPose(rng).rotation};
  object.covariance.diagonal().setConstant(rng.Uniform(0.01, 0.02));
  object.mean_iou = rng.Uniform(0.3, 0.9);
  object.total_observations = 40 + rng.Index(100);
  object.last_seen_frame = rng.Index(300);
  const auto ids = map.keyframes.Ids();
  for (int i = 0; i < 5; ++i)
    object.observations.push_back({10 * i, ids[rng.Index(static_cast<int>(ids.size()))],
                                   RandomPose(rng), 0, Box{1.5, 2.25, 30 + i * 0.125, 40},
                                   rng.Uniform(0.3, 0.9),
                                   static_cast<unsigned char>(rng.Index(16))});
  for (uint32_t i = 0; i < 6; ++i) {
    object.landmarks.push_back(LandmarkId(3 * i));
    object.landmark_votes.push_back(static_cast<uint16_t>(rng.Index(500)));
  }
  return object;
}

// Every third key point; every second of these has a depth.
inline void DescribeSome(Keyframe& keyframe) {
  Features features = *keyframe.features;
  for (size_t i = 0; i < features.keypoints.size(); i += 3) {
    Descriptor descriptor = features.descriptors[i];
    std::ranges::reverse(descriptor);
    features.learned.keypoints.push_back(static_cast<uint16_t>(i));
    features.learned.descriptors.push_back(descriptor);
    keyframe.learned_depths.push_back(i % 2 ? 0.25F * static_cast<float>(i) : 0);
  }
  keyframe.features = std::make_shared<const Features>(std::move(features));
}

// A map with every kind of content: erased and merged landmarks, a retired keyframe, merged
// objects, two cameras.
inline SavedMap RandomMap(const RandomMapOptions& options, Rng& rng) {
  SavedMap saved;
  Map& map = saved.map;
  Camera& pinhole = map.cameras.emplace_back(
      Camera{.width = 640, .height = 480, .fx = 520.9, .fy = 521, .cx = 325.1, .cy = 249.7});
  pinhole.distortion = {0.2, -0.7, 0, 0.001, 0.9};
  pinhole.name = "a";
  Camera& fisheye = map.cameras.emplace_back(
      Camera{.width = 848, .height = 800, .fx = 286, .fy = 287, .cx = 421, .cy = 398});
  fisheye.model = LensModel::kFisheye;
  fisheye.is_guess = true;
  for (int k = 0; k < options.keyframes; ++k) {
    Keyframe keyframe;
    keyframe.frame_index = 7 * k;
    keyframe.timestamp = 1311868164.363181 + k / 3.0;
    keyframe.camera = k % 2;
    keyframe.cam_from_world = RandomPose(rng);
    keyframe.features = RandomFeatures(options.keypoints, rng);
    keyframe.landmarks.resize(options.keypoints);
    if (k % 3 != 2) DescribeSome(keyframe);
    map.keyframes.Insert(KeyframeId(static_cast<uint32_t>(2 * k)), std::move(keyframe));
  }
  const auto ids = map.keyframes.Ids();
  for (int i = 0; i < options.landmarks; ++i) {
    const auto first = static_cast<size_t>(rng.Index(options.keyframes));
    const LandmarkId id =
        map.AddLandmark({rng.Gaussian(2), rng.Gaussian(2), rng.Uniform(2, 9)}, ids[first]);
    for (int v = 0; v < options.views; ++v)
      for (int attempt = 0; attempt < 200; ++attempt)
        if (map.AddObservation(id, ids[(first + v) % ids.size()],
                               static_cast<uint32_t>(rng.Index(options.keypoints))))
          break;
    if (map.landmarks.At(id).observations.size() < 2)
      map.EraseLandmark(id);
    else
      map.UpdateLandmark(id);
  }
  map.EraseLandmark(LandmarkId(5));
  for (const KeyframeId id : ids) map.UpdateCovisibility(id, 2);
  map.RetireKeyframe(ids[2]);
  for (int i = 0; i < options.objects; ++i)
    map.objects.Insert(ObjectId(static_cast<uint32_t>(i + 1)), RandomObject(map, rng));
  if (options.objects > 0) {
    map.merged_objects.Insert(ObjectId(0), ObjectId(1));
    Object& doubtful = map.objects.MutableAt(ObjectId(1));
    doubtful.category_id = 45;
    doubtful.shares = {{41, 0.25}, {45, 0.75}};
  }
  map.up = Eigen::Vector3d(0.1, -0.9, 0.2).normalized();
  map.up_keyframes = 7;
  map.version = 41;
  for (int i = 0; i < 20; ++i)
    saved.trajectory.push_back({i, 1.5 + i / 30.0, ids[static_cast<size_t>(i) % ids.size()],
                                RandomPose(rng), static_cast<TrackingState>(i % 5)});
  saved.class_names = {{41, "cup"}, {56, "chair"}};
  return saved;
}

}  // namespace oaslam
