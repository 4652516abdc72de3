#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "oaslam/objects/association.h"
#include "oaslam/objects/known_poses.h"
#include "oaslam/objects/life_cycle.h"
#include "oaslam/objects/object_mapper.h"
#include "oaslam/objects/object_merging.h"
#include "oaslam/objects/upright.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

const Camera kCamera{.width = 640, .height = 480, .fx = 520, .fy = 520, .cx = 320, .cy = 240};
const Eigen::Vector3d kUp(0, 0, 1);

struct TrueObject {
  int category_id;
  Ellipsoid ellipsoid;
};

// A table with two cups side by side, a book and a bottle.
std::vector<TrueObject> Table() {
  const auto turned = [](double yaw) {
    return Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  };
  return {{41, {{-0.1, 0, 0.05}, {0.05, 0.05, 0.06}, turned(0)}},
          {41, {{0.1, 0.05, 0.05}, {0.05, 0.05, 0.06}, turned(0)}},
          {73, {{0.3, -0.3, 0.02}, {0.15, 0.1, 0.03}, turned(0.7)}},
          {39, {{-0.3, 0.3, 0.12}, {0.04, 0.04, 0.12}, turned(0)}}};
}

Rigid3 LookAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, double roll = 0) {
  const Eigen::Vector3d z = (target - eye).normalized(), x = z.cross(kUp).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return {Eigen::Quaterniond(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ())) *
              Eigen::Quaterniond(rotation),
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()) * (-rotation * eye)};
}

struct Noise {
  double box_px = 1, miss_rate = 0.1, false_rate = 0.1;
};

std::vector<PosedDetections> Film(const std::vector<TrueObject>& objects, int frames,
                                  const Noise& noise, uint64_t seed) {
  Rng rng(seed);
  std::vector<PosedDetections> film;
  for (int i = 0; i < frames; ++i) {
    const double angle = 2.0 * i / frames;
    PosedDetections frame;
    frame.frame_index = i;
    frame.timestamp = i / 30.0;
    frame.cam_from_world =
        LookAt({1.4 * std::cos(angle), 1.4 * std::sin(angle), 0.7 + 0.1 * std::sin(7 * angle)},
               {0, 0, 0.05}, rng.Gaussian(0.03));
    for (const TrueObject& object : objects) {
      if (rng.Uniform(0, 1) < noise.miss_rate) continue;
      Box box = *ProjectToBox(object.ellipsoid, frame.cam_from_world, kCamera);
      for (double* edge : {&box.x1, &box.y1, &box.x2, &box.y2}) *edge += rng.Gaussian(noise.box_px);
      frame.detections.push_back({object.category_id, 0.8, box, 0});
    }
    if (rng.Uniform(0, 1) < noise.false_rate) {
      const double x = rng.Uniform(0, 560), y = rng.Uniform(0, 400);
      frame.detections.push_back({41, 0.6, {x, y, x + 60, y + 60}, 0});
    }
    frame.detections.push_back(
        {41, 0.4, {300, 20, 360, 80}, 0});  // below the least score for mapping
    film.push_back(std::move(frame));
  }
  return film;
}

std::vector<Object> MappedObjects(const Map& map) {
  std::vector<Object> mapped;
  map.objects.ForEach([&](ObjectId, const Object& o) {
    if (o.state == ObjectState::kMapped) mapped.push_back(o);
  });
  return mapped;
}

double DistanceToNearest(const TrueObject& truth, const std::vector<Object>& mapped) {
  double nearest = 1e9;
  for (const Object& o : mapped)
    if (o.category_id == truth.category_id)
      nearest = std::min(nearest, (o.ellipsoid.center - truth.ellipsoid.center).norm());
  return nearest;
}

TEST(ObjectMapping, FindsWhatIsOnTheTableAndNothingElse) {
  const auto objects = Table();
  for (const ObjectMethod model : {ObjectMethod::kRobust, ObjectMethod::kPaper}) {
    ObjectsConfig config;
    config.model = model;
    const KnownPoseMap result =
        MapObjectsFromKnownPoses(Film(objects, 150, {}, 1), kCamera, config);
    const std::vector<Object> mapped = MappedObjects(result.map);
    EXPECT_EQ(mapped.size(), objects.size()) << static_cast<int>(model);
    for (const TrueObject& truth : objects)
      EXPECT_LT(DistanceToNearest(truth, mapped), 0.02) << static_cast<int>(model);
    EXPECT_GT(result.mean_iou, 0.85) << static_cast<int>(model);
    for (const Object& o : mapped) {
      EXPECT_LE(o.observations.size(), 60U);
      EXPECT_GT(o.total_observations, 100);
      EXPECT_GT(o.detection_rate, 0.8);
      EXPECT_LT(o.detection_rate, 0.97);
      EXPECT_GT(o.covariance.diagonal().minCoeff(), 0);
      EXPECT_LT(std::sqrt(o.covariance.topLeftCorner<3, 3>().trace()), 0.05);
    }
    EXPECT_TRUE(result.map.CheckInvariants().empty());
  }
}

TEST(ObjectMapping, IsTheSameOnEveryRun) {
  const auto film = Film(Table(), 80, {}, 2);
  const KnownPoseMap a = MapObjectsFromKnownPoses(film, kCamera, {}),
                     b = MapObjectsFromKnownPoses(film, kCamera, {});
  ASSERT_FALSE(a.map.objects.empty());
  ASSERT_EQ(a.map.objects.Ids(), b.map.objects.Ids());
  for (const ObjectId id : a.map.objects.Ids())
    EXPECT_EQ(a.map.objects.At(id).ellipsoid.center, b.map.objects.At(id).ellipsoid.center);
}

TEST(ObjectMapping, ScaleOfTheMapDoesNotMatter) {
  auto film = Film(Table(), 120, {}, 3);
  const auto near = MappedObjects(MapObjectsFromKnownPoses(film, kCamera, {}).map);
  for (PosedDetections& frame : film) frame.cam_from_world.translation *= 50;
  const auto far = MappedObjects(MapObjectsFromKnownPoses(film, kCamera, {}).map);
  ASSERT_EQ(near.size(), Table().size());
  ASSERT_EQ(near.size(), far.size());
  for (size_t i = 0; i < near.size(); ++i) {
    EXPECT_LT((far[i].ellipsoid.center - 50 * near[i].ellipsoid.center).norm(), 0.01 * 50);
    EXPECT_LT((far[i].ellipsoid.half_axes - 50 * near[i].ellipsoid.half_axes).norm(), 0.01 * 50);
  }
}

TEST(ObjectMapping, SlowVideoNeedsNoMoreTime) {
  // Five seconds of video: each image of a slower video counts more.
  const auto film = Film(Table(), 150, {}, 8);
  for (const size_t step : {1, 3, 6, 15}) {
    std::vector<PosedDetections> slow;
    for (size_t i = 0; i < film.size(); i += step) {
      slow.push_back(film[i]);
      slow.back().frame_index = static_cast<int>(i / step);
    }
    const auto mapped = MappedObjects(MapObjectsFromKnownPoses(slow, kCamera, {}).map);
    EXPECT_EQ(mapped.size(), Table().size()) << step;
    for (const TrueObject& truth : Table())
      EXPECT_LT(DistanceToNearest(truth, mapped), 0.02) << step;
  }
}

TEST(ObjectMapping, FastVideoNeedsNoLessTime) {
  // At 120 Hz 20 detections are a sixth of a second.
  auto film = Film(Table(), 150, {}, 8);
  const auto mapped_after = [&](size_t count) {
    return MappedObjects(MapObjectsFromKnownPoses(std::span(film).first(count), kCamera, {}).map)
        .size();
  };
  EXPECT_EQ(mapped_after(60), Table().size());
  for (PosedDetections& frame : film) frame.timestamp /= 4;
  EXPECT_EQ(mapped_after(60), 0U);
}

TEST(ObjectMapping, SizeAndOrientationOfTheImageDoNotMatter) {
  const auto film = Film(Table(), 120, {.box_px = 3, .miss_rate = 0.1, .false_rate = 0.1}, 9);
  const auto known = MapObjectsFromKnownPoses(film, kCamera, {});
  const auto expected = MappedObjects(known.map);
  ASSERT_EQ(expected.size(), Table().size());
  for (const double scale : {0.25, 6.0})
    for (const bool is_turned : {false, true}) {
      Camera camera = kCamera;
      camera.width = static_cast<int>(scale * kCamera.width);
      camera.height = static_cast<int>(scale * kCamera.height);
      camera.fx = camera.fy = scale * kCamera.fx;
      camera.cx = scale * (kCamera.cx + 0.5) - 0.5;
      camera.cy = scale * (kCamera.cy + 0.5) - 0.5;
      // The world is turned by 90 degrees: what was left is now above.
      if (is_turned) {
        std::swap(camera.width, camera.height);
        camera.cx = camera.width - 1 - (scale * (kCamera.cy + 0.5) - 0.5);
        camera.cy = scale * (kCamera.cx + 0.5) - 0.5;
      }
      auto other = film;
      for (PosedDetections& frame : other) {
        const Rigid3 turn(Eigen::Quaterniond(Eigen::AngleAxisd(is_turned ? M_PI / 2 : 0,
                                                               Eigen::Vector3d::UnitZ())),
                          {0, 0, 0});
        frame.cam_from_world = turn * frame.cam_from_world;
        for (ObjectDetection& d : frame.detections) {
          d.box = {scale * d.box.x1, scale * d.box.y1, scale * d.box.x2, scale * d.box.y2};
          if (is_turned)
            d.box = {camera.width - d.box.y2, d.box.x1, camera.width - d.box.y1, d.box.x2};
        }
      }
      const auto mapped = MappedObjects(MapObjectsFromKnownPoses(other, camera, {}).map);
      ASSERT_EQ(mapped.size(), expected.size()) << scale << is_turned;
      // The turned map has no vertical, so that the shapes have more freedom.
      for (size_t i = 0; i < mapped.size(); ++i) {
        EXPECT_LT((mapped[i].ellipsoid.center - expected[i].ellipsoid.center).norm(),
                  is_turned ? 0.01 : 1e-4)
            << scale << is_turned;
        EXPECT_NEAR(mapped[i].covariance(0, 0) / expected[i].covariance(0, 0), 1,
                    is_turned ? 0.5 : 1e-3)
            << scale << is_turned;
      }
    }
}

TEST(ObjectMapping, OnlyBriefSightingsAreDropped) {
  auto film = Film(Table(), 200, {}, 4);
  for (int i = 10; i < 25; ++i)
    film[i].detections.push_back({0, 0.9, {100.0 + i, 100, 160.0 + i, 220}, 0});
  const KnownPoseMap result = MapObjectsFromKnownPoses(film, kCamera, {});
  EXPECT_EQ(MappedObjects(result.map).size(), Table().size());
  result.map.objects.ForEach([&](ObjectId, const Object& o) { EXPECT_NE(o.category_id, 0); });
}

TEST(ObjectMapping, FollowsCorrectedKeyframes) {
  const auto film = Film(Table(), 120, {}, 5);
  Map map = MapObjectsFromKnownPoses(film, kCamera, {}).map;
  const Rigid3 moved_from_world(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
      {3, -2, 1});
  for (const KeyframeId id : map.keyframes.Ids()) {
    Keyframe& keyframe = map.keyframes.MutableAt(id);
    keyframe.cam_from_world = keyframe.cam_from_world * moved_from_world.Inverse();
  }
  const auto before = MappedObjects(map);
  UpdateObjects(map, {}, {120, 4}, {});
  const auto after = MappedObjects(map);
  ASSERT_EQ(before.size(), Table().size());
  ASSERT_EQ(before.size(), after.size());
  for (size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((after[i].ellipsoid.center - moved_from_world * before[i].ellipsoid.center).norm(),
              0.01);
}

// A wide object stands in front of a long one, so that the detector sees only the part of the long
// one beside it.
std::vector<PosedDetections> FilmWithOcclusion(const TrueObject& front, const TrueObject& behind,
                                               bool cut) {
  std::vector<PosedDetections> film =
      Film({front}, 160, {.box_px = 1, .miss_rate = 0, .false_rate = 0}, 3);
  for (PosedDetections& frame : film) {
    const Box hiding = *ProjectToBox(front.ellipsoid, frame.cam_from_world, kCamera);
    Box box = *ProjectToBox(behind.ellipsoid, frame.cam_from_world, kCamera);
    const bool is_nearer = (frame.cam_from_world * front.ellipsoid.center).z() <
                           (frame.cam_from_world * behind.ellipsoid.center).z();
    if (cut && is_nearer && hiding.x1 < box.x2 && hiding.x2 > box.x2) box.x2 = hiding.x1;
    if (cut && is_nearer && hiding.x2 > box.x1 && hiding.x1 < box.x1) box.x1 = hiding.x2;
    if (box.Width() > 8) frame.detections.push_back({behind.category_id, 0.8, box, 0});
  }
  return film;
}

TEST(Occlusion, WhatAnotherObjectHidesDoesNotPullAtTheModel) {
  const TrueObject front{75, {{0.45, 0.2, 0.15}, {0.1, 0.1, 0.2}, Eigen::Quaterniond::Identity()}};
  const TrueObject behind{66,
                          {{-0.05, 0.25, 0.05}, {0.2, 0.2, 0.06}, Eigen::Quaterniond::Identity()}};
  const auto error_of = [&](ObjectMethod model, bool cut) {
    ObjectsConfig config;
    config.model = model;
    config.min_accept_share = 0.5;
    const KnownPoseMap result =
        MapObjectsFromKnownPoses(FilmWithOcclusion(front, behind, cut), kCamera, config);
    double error = 1;
    for (const Object& object : MappedObjects(result.map))
      if (object.category_id == behind.category_id)
        error = std::min(error, (object.ellipsoid.center - behind.ellipsoid.center).norm());
    return error;
  };
  EXPECT_LT(error_of(ObjectMethod::kRobust, false), 0.01);
  EXPECT_LT(error_of(ObjectMethod::kRobust, true), 0.015);
  EXPECT_GT(error_of(ObjectMethod::kPaper, true),
            0.025);  // the paper's model treats cut boxes as complete
}

TEST(Upright, IsTheAxisAboutWhichTheCamerasTurn) {
  Map map;
  const auto film = Film({}, 100, {}, 6);
  for (size_t i = 0; i < film.size(); ++i) {
    Keyframe keyframe;
    keyframe.cam_from_world = film[i].cam_from_world;
    map.keyframes.Insert(KeyframeId(static_cast<uint32_t>(i)), keyframe);
    if (i == 8) {
      UpdateUp(map);
      EXPECT_FALSE(map.up);  // the camera turned too little
    }
  }
  UpdateUp(map);
  ASSERT_TRUE(map.up);
  EXPECT_GT(map.up->dot(kUp), std::cos(0.03));
}

// ---- association

TrackedFrame FrameWith(int index, std::vector<ObjectDetection> detections) {
  TrackedFrame tracked;
  tracked.frame.index = index;
  tracked.frame.timestamp = index / 30.0;
  tracked.frame.detections = std::move(detections);
  tracked.reference = KeyframeId(0);
  return tracked;
}

Map EmptyMap() {
  Map map;
  map.cameras = {kCamera};
  return map;
}

TEST(Association, CrossingBoxesKeepTheirObjects) {
  // Two boxes pass each other. At every step each is nearer to its own last
  // place than to the other's.
  const Map map = EmptyMap();
  ObjectTracks tracks;
  ObjectId left, right;
  for (int i = 0; i <= 40; ++i) {
    const Box a{100.0 + 4 * i, 100, 180.0 + 4 * i, 180}, b{260.0 - 4 * i, 120, 340.0 - 4 * i, 220};
    const bool swapped = i % 2 == 1;  // the order of detections does not matter
    const ObjectDetection da{41, 0.9, a, 0}, db{41, 0.9, b, 0};
    auto result = AssociateObjects(
        FrameWith(i, swapped ? std::vector{db, da} : std::vector{da, db}), map, tracks, {});
    tracks = result.tracks;
    ASSERT_EQ(result.sightings.size(), 2U);
    const ObjectSighting &sa = result.sightings[swapped ? 1 : 0],
                         &sb = result.sightings[swapped ? 0 : 1];
    if (i == 0) {
      left = sa.object;
      right = sb.object;
      EXPECT_TRUE(sa.is_new && sb.is_new);
    }
    EXPECT_EQ(sa.object, left) << i;
    EXPECT_EQ(sb.object, right) << i;
  }
  EXPECT_EQ(tracks.open.size(), 2U);
}

TEST(Association, ClassesDoNotMixAndOldBoxesAreForgotten) {
  const Map map = EmptyMap();
  const Box box{100, 100, 180, 180};
  auto first = AssociateObjects(FrameWith(0, {{41, 0.9, box, 0}}), map, {}, {});
  auto other_class = AssociateObjects(FrameWith(1, {{39, 0.9, box, 0}}), map, first.tracks, {});
  EXPECT_TRUE(other_class.sightings[0].is_new);
  auto late = AssociateObjects(FrameWith(20, {{41, 0.9, box, 0}}), map, first.tracks, {});
  EXPECT_TRUE(late.sightings[0].is_new);
  auto soon = AssociateObjects(FrameWith(10, {{41, 0.9, box, 0}}), map, first.tracks, {});
  EXPECT_FALSE(soon.sightings[0].is_new);
}

Object MappedCup(const Eigen::Vector3d& center) {
  Object object;
  object.category_id = 41;
  object.state = ObjectState::kMapped;
  object.ellipsoid = {center, {0.1, 0.1, 0.1}, Eigen::Quaterniond::Identity()};
  return object;
}

TEST(Association, ASmallThingIsFollowedAsTheCameraMoves) {
  // From image to image the boxes of two cups move by more than their width.
  Map map = EmptyMap();
  map.keyframes.Insert(KeyframeId(0), {});
  const std::vector<Ellipsoid> cups = {MappedCup({0, 0, 4}).ellipsoid,
                                       MappedCup({0.3, 0.3, 4}).ellipsoid};
  const LandmarkId beside = map.AddLandmark({0, 0, 4}, KeyframeId(0));
  ObjectTracks tracks;
  for (int i = 0; i < 5; ++i) {
    TrackedFrame tracked = FrameWith(i, {});
    tracked.landmarks = {beside};
    tracked.cam_from_world.translation.x() = -0.3 * i;
    tracked.cam_from_reference = tracked.cam_from_world;
    for (const Ellipsoid& cup : cups)
      tracked.frame.detections.push_back(
          {41, 0.9, *ProjectToBox(cup, tracked.cam_from_world, kCamera), 0});
    const auto result = AssociateObjects(tracked, map, tracks, {});
    tracks = result.tracks;
    ASSERT_EQ(result.sightings.size(), 2U);
    EXPECT_EQ(result.sightings[0].object, ObjectId(0)) << i;
    EXPECT_EQ(result.sightings[1].object, ObjectId(1)) << i;
  }
}

TEST(Association, MapObjectsAreFoundByTheirProjection) {
  Map map = EmptyMap();
  map.objects.Insert(ObjectId(7), MappedCup({0, 0, 2}));
  const Box seen = *ProjectToBox(map.objects.At(ObjectId(7)).ellipsoid, Rigid3(), kCamera);
  const ObjectTracks tracks = ObjectTracks::ContinueFrom(map);
  const auto hit = AssociateObjects(FrameWith(500, {{41, 0.9, seen, 0}}), map, tracks, {});
  ASSERT_EQ(hit.sightings.size(), 1U);
  EXPECT_EQ(hit.sightings[0].object, ObjectId(7));
  EXPECT_FALSE(hit.sightings[0].is_new);
  const auto miss =
      AssociateObjects(FrameWith(500, {{41, 0.9, {10, 10, 60, 60}, 0}}), map, tracks, {});
  ASSERT_EQ(miss.sightings.size(), 2U);
  EXPECT_EQ(miss.sightings[0].object, ObjectId(8));  // new ids follow those of the map
  EXPECT_FALSE(miss.sightings[1].detected);
  EXPECT_EQ(miss.sightings[1].object, ObjectId(7));
}

TEST(Association, ADetectionThatIsTakenForAnotherClassIsFollowedByItsOtherLabel) {
  Map map = EmptyMap();
  map.objects.Insert(ObjectId(7), MappedCup({0, 0, 2}));
  const Box seen = *ProjectToBox(map.objects.At(ObjectId(7)).ellipsoid, Rigid3(), kCamera);
  const ObjectTracks tracks = ObjectTracks::ContinueFrom(map);
  const auto object_of = [&](const ObjectDetection& detection) {
    return AssociateObjects(FrameWith(500, {detection}), map, tracks, {}).sightings[0].object;
  };
  const LabelShares doubtful{{41, 0.4}, {45, 0.6}};
  EXPECT_NE(object_of({45, 0.9, seen, 0}), ObjectId(7));
  EXPECT_EQ(object_of({45, 0.9, seen, 0, doubtful}), ObjectId(7));
  // A thing beside it, of which the detector is as unsure, is another: the less the labels say,
  // the more the boxes must agree.
  Box beside = seen;
  beside.x1 += seen.Width() / 3;
  beside.x2 += seen.Width() / 3;
  EXPECT_EQ(object_of({41, 0.9, beside, 0}), ObjectId(7));
  EXPECT_NE(object_of({45, 0.9, beside, 0, doubtful}), ObjectId(7));
}

TEST(Association, OneLabelAsksForTheOverlapThatIsConfigured) {
  const Map map = EmptyMap();
  const auto first =
      AssociateObjects(FrameWith(0, {{41, 0.9, {100, 100, 113, 110}, 0}}), map, {}, {});
  // 6 of 20 columns are common to both: an overlap of exactly objects.min_iou_box.
  const auto next =
      AssociateObjects(FrameWith(1, {{41, 0.9, {107, 100, 120, 110}, 0}}), map, first.tracks, {});
  ASSERT_EQ(IoU({100, 100, 113, 110}, {107, 100, 120, 110}), ObjectsConfig().min_iou_box);
  EXPECT_FALSE(next.sightings[0].is_new);
}

TEST(Association, AmongNearThingsTheLabelDecides) {
  Map map = EmptyMap();
  map.objects.Insert(ObjectId(7), MappedCup({0, 0, 2}));
  map.objects.Insert(ObjectId(8), MappedCup({0.02, 0, 2}));
  map.objects.MutableAt(ObjectId(7)).shares = {{41, 0.8}, {45, 0.2}};
  map.objects.MutableAt(ObjectId(8)).shares = {{41, 0.2}, {45, 0.8}};
  map.objects.MutableAt(ObjectId(8)).category_id = 45;
  const Box seen = *ProjectToBox(map.objects.At(ObjectId(7)).ellipsoid, Rigid3(), kCamera);
  const ObjectTracks tracks = ObjectTracks::ContinueFrom(map);
  for (const auto& [category, object] : {std::pair{41, 7U}, {45, 8U}}) {
    const auto found =
        AssociateObjects(FrameWith(500, {{category, 0.9, seen, 0}}), map, tracks, {});
    EXPECT_EQ(found.sightings[0].object, ObjectId(object));
  }
}

TEST(Association, OnlyWhatTheLensShowsIsMissed) {
  // With barrel distortion, a place above the middle of the image's upper border can be within the
  // bounding rectangle of the ideal image.
  Camera camera = kCamera;
  camera.fx = camera.fy = 400;
  camera.distortion = {-0.3, 0.08, 0, 0, 0};
  const double top = IdealImageBounds(camera).y1;
  for (const double y : {top + 40, 60.0}) {
    Map map;
    map.cameras = {camera};
    const Eigen::Vector3d ray = RayOf(camera, {camera.cx, y});
    map.objects.Insert(ObjectId(7), MappedCup(4 * ray));
    const auto found = AssociateObjects(FrameWith(0, {{1, 0.9, {10, 10, 60, 60}, 0}}), map,
                                        ObjectTracks::ContinueFrom(map), {});
    const auto missed = std::ranges::count(found.sightings, false, &ObjectSighting::detected);
    EXPECT_EQ(missed, y > 0 ? 1 : 0) << y;
  }
}

TEST(Association, ABoxIsRememberedForAWhileOrForOneImage) {
  const Map map = EmptyMap();
  const Box box{100, 100, 180, 180};
  const auto first = AssociateObjects(FrameWith(0, {{41, 0.9, box, 0}}), map, {}, {});
  TrackedFrame next = FrameWith(1, {{41, 0.9, box, 0}});
  next.frame.timestamp = 1;  // one image a second
  EXPECT_FALSE(AssociateObjects(next, map, first.tracks, {}).sightings[0].is_new);
  next.frame.index = 3;
  EXPECT_TRUE(AssociateObjects(next, map, first.tracks, {}).sightings[0].is_new);
}

TEST(Association, ABoxOfWhichNothingIsLeftOpensNoTrack) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Box& box : {Box{180, 100, 100, 180}, Box{100, 100, 100, 180}, Box{nan, 1, 9, 9}}) {
    const auto result = AssociateObjects(FrameWith(0, {{41, 0.9, box, 0}}), EmptyMap(), {}, {});
    EXPECT_TRUE(result.sightings.empty());
    EXPECT_TRUE(result.tracks.open.empty());
  }
}

TEST(Association, AnImageOfASlowVideoSaysMore) {
  const Map map = EmptyMap();
  const auto weight_after = [&](double seconds) {
    const auto first =
        AssociateObjects(FrameWith(0, {{41, 0.9, {100, 100, 180, 180}, 0}}), map, {}, {});
    TrackedFrame next = FrameWith(1, {{41, 0.9, {100, 100, 180, 180}, 0}});
    next.frame.timestamp = seconds;
    return AssociateObjects(next, map, first.tracks, {}).sightings[0].observation.weight;
  };
  EXPECT_NEAR(weight_after(1 / 120.0), 0.25, 1e-9);
  EXPECT_NEAR(weight_after(1 / 30.0), 1, 1e-9);
  EXPECT_NEAR(weight_after(0.1), 3, 1e-9);
  EXPECT_NEAR(weight_after(1), 6, 1e-9);
}

TEST(Association, SharedLandmarksOutweighOverlap) {
  Map map = EmptyMap();
  map.objects.Insert(ObjectId(0), MappedCup({0, 0, 2}));
  Object elsewhere = MappedCup({0.15, 0, 2});
  for (uint32_t i = 0; i < 20; ++i) {
    elsewhere.landmarks.push_back(LandmarkId(i));
    elsewhere.landmark_votes.push_back(5);
  }
  map.objects.Insert(ObjectId(1), elsewhere);
  const Box box = *ProjectToBox(map.objects.At(ObjectId(0)).ellipsoid, Rigid3(), kCamera);
  TrackedFrame tracked = FrameWith(0, {{41, 0.9, box, 0}});
  auto features = std::make_shared<Features>();
  for (uint32_t i = 0; i < 20; ++i) {
    Keypoint keypoint;
    keypoint.px = box.Center().cast<float>();
    features->keypoints.push_back(keypoint);
    tracked.landmarks.push_back(LandmarkId(i));
  }
  tracked.frame.features = features;
  EXPECT_EQ(AssociateObjects(tracked, map, {}, {}).sightings[0].object, ObjectId(1));
  tracked.landmarks.assign(20, LandmarkId());
  EXPECT_EQ(AssociateObjects(tracked, map, {}, {}).sightings[0].object, ObjectId(0));
}

TEST(Association, WhatHasNoEllipsoidYetIsFoundAgainByItsLandmarks) {
  Map map = EmptyMap();
  Object passed = MappedCup({0, 0, 2});
  passed.state = ObjectState::kTentative;
  passed.known_by_landmarks = true;
  auto features = std::make_shared<Features>();
  TrackedFrame tracked = FrameWith(900, {{41, 0.9, {300, 200, 340, 240}, 0}});
  for (uint32_t i = 0; i < 12; ++i) {
    passed.landmarks.push_back(LandmarkId(i));
    passed.landmark_votes.push_back(3);
    Keypoint keypoint;
    keypoint.px = {320, 220};
    features->keypoints.push_back(keypoint);
    tracked.landmarks.push_back(LandmarkId(i));
  }
  tracked.frame.features = features;
  map.objects.Insert(ObjectId(0), passed);
  EXPECT_EQ(AssociateObjects(tracked, map, ObjectTracks::ContinueFrom(map), {}).sightings[0].object,
            ObjectId(0));
  map.objects.MutableAt(ObjectId(0)).known_by_landmarks = false;
  EXPECT_TRUE(
      AssociateObjects(tracked, map, ObjectTracks::ContinueFrom(map), {}).sightings[0].is_new);
}

TEST(Association, FollowsMergedAndDroppedObjects) {
  Map map = EmptyMap();
  map.objects.Insert(ObjectId(0), MappedCup({0, 0, -5}));
  map.merged_objects.Insert(ObjectId(1), ObjectId(0));
  ObjectTracks tracks;
  tracks.next_object = 3;
  tracks.open = {{ObjectId(1), 41, {10, 10, 60, 60}, 4, 4 / 30.0, true},
                 {ObjectId(2), 41, {200, 10, 260, 60}, 4, 4 / 30.0, true}};
  const auto result = AssociateObjects(
      FrameWith(5, {{41, 0.9, {10, 10, 60, 60}, 0}, {41, 0.9, {200, 10, 260, 60}, 0}}), map, tracks,
      {});
  EXPECT_EQ(result.sightings[0].object, ObjectId(0));  // the object continues under this id
  EXPECT_EQ(result.sightings[1].object,
            ObjectId(3));  // object 2 was dropped: the detection opens a new track
}

TEST(LifeCycle, WhatWasNeverMappedIsForgottenAfterATimeAndSomeImages) {
  const ObjectsConfig config;
  EXPECT_FALSE(IsForgotten({60, 1.9}, config));
  EXPECT_TRUE(IsForgotten({61, 2.1}, config));
  EXPECT_FALSE(IsForgotten({3, 3}, config));  // one image a second
  EXPECT_TRUE(IsForgotten({5, 5}, config));
}

TEST(LifeCycle, Transitions) {
  ObjectsConfig config;
  config.min_observations = 40;
  const auto next = [&](ObjectState state, bool has_model, double observations, double share,
                        bool is_forgotten) {
    return NextState(state, {has_model, observations, {0.8, share}, is_forgotten}, config);
  };
  EXPECT_EQ(next(ObjectState::kTentative, false, 100, 0, false), ObjectState::kTentative);
  EXPECT_EQ(next(ObjectState::kTentative, false, 100, 0, true), std::nullopt);
  EXPECT_EQ(next(ObjectState::kTentative, true, 12, 1, false), ObjectState::kInitialized);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 39, 1, false), ObjectState::kInitialized);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 40, 0.95, false), ObjectState::kMapped);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 40, 0.85, false), ObjectState::kInitialized);
  EXPECT_EQ(next(ObjectState::kInitialized, true, 39, 1, true), std::nullopt);
  EXPECT_EQ(next(ObjectState::kMapped, true, 400, 0.8, true), ObjectState::kMapped);
  EXPECT_EQ(next(ObjectState::kMapped, true, 400, 0.4, false), ObjectState::kInitialized);
}

TEST(LifeCycle, TheMeanOverlapOfAMappedObjectIsNotBelowTheBound) {
  // Most boxes are cut by the image border and agree with any ellipsoid; the
  // few others do not agree.
  const ObjectsConfig config;
  const ViewOverlap bad{config.min_accept_iou - 0.02, 0.92};
  const ViewOverlap good{config.min_accept_iou + 0.02, 0.92};
  EXPECT_EQ(NextState(ObjectState::kInitialized, {true, 274, bad, false}, config),
            ObjectState::kInitialized);
  EXPECT_EQ(NextState(ObjectState::kInitialized, {true, 274, good, false}, config),
            ObjectState::kMapped);
  EXPECT_EQ(NextState(ObjectState::kMapped, {true, 274, bad, false}, config),
            ObjectState::kInitialized);
  EXPECT_EQ(NextState(ObjectState::kMapped, {true, 274, good, false}, config),
            ObjectState::kMapped);
}

// ---- merging

// Cup 0 mapped as two objects: from observations before frame `split` and after it.
Map SplitMap(bool really_two) {
  std::vector<TrueObject> objects = {Table()[0]};
  if (really_two)
    objects.push_back({41, {{-0.1, 0, 0.05}, {0.02, 0.02, 0.02}, Eigen::Quaterniond::Identity()}});
  Map map = EmptyMap();
  const auto features = std::make_shared<const Features>();
  const auto film = Film(objects, 200, {1, 0, 0}, 7);
  for (uint32_t k = 0; k < 200; ++k) {
    map.keyframes.Insert(
        KeyframeId(k),
        {static_cast<int>(k), k / 30.0, 0, film[k].cam_from_world, features, {}, {}});
    const size_t which = really_two ? 1 : 0;
    ObjectSighting first, second;
    first.object = ObjectId(0);
    second.object = ObjectId(1);
    first.category_id = second.category_id = 41;
    first.is_new = k == 0;
    second.is_new = really_two ? k == 0 : k == 100;
    const auto observe = [&](size_t d) {
      return ObjectObservation{static_cast<int>(k),       KeyframeId(k), Rigid3(), 0,
                               film[k].detections[d].box, 0.8,           0};
    };
    first.observation = observe(0);
    second.observation = observe(which);
    std::vector<ObjectSighting> sightings;
    if (really_two || k < 100) sightings.push_back(first);
    if (really_two || k >= 100) sightings.push_back(second);
    ObjectsConfig config;
    config.drop_after_s = 1000;
    UpdateObjects(map, sightings, {static_cast<int>(k), k / 30.0}, config);
  }
  return map;
}

TEST(Merging, OneObjectTrackedTwiceBecomesOne) {
  const Map map = SplitMap(false);
  EXPECT_EQ(map.objects.size(), 1U);
  ASSERT_TRUE(map.ResolveObject(ObjectId(1)));
  EXPECT_EQ(*map.ResolveObject(ObjectId(1)), ObjectId(0));
  EXPECT_EQ(map.objects.At(ObjectId(0)).total_observations, 200);
  EXPECT_EQ(map.objects.At(ObjectId(0)).state, ObjectState::kMapped);
}

// A book passed twice, half a minute apart, from two sides: each time too briefly to tell where it
// is, and tracked as two objects. `own` landmarks are on it.
Map PassedTwice(int own, const ObjectsConfig& config) {
  constexpr int kImages = 15, kPause = 900;
  const TrueObject book = Table()[2];
  Map map = EmptyMap();
  const auto features = std::make_shared<const Features>();
  std::vector<LandmarkId> landmarks;
  Rng rng(4);
  for (int i = 0; i < own; ++i)
    landmarks.push_back(map.AddLandmark(
        book.ellipsoid.center +
            0.05 * Eigen::Vector3d(rng.Gaussian(1), rng.Gaussian(1), rng.Gaussian(1)),
        KeyframeId(0)));
  for (int i = 0; i < 2 * kImages; ++i) {
    const bool again = i >= kImages;
    const int frame = again ? kPause + i : i;
    const double angle = 0.005 * i + (again ? 0.6 : 0);
    const Rigid3 pose = LookAt({1.4 * std::cos(angle), 1.4 * std::sin(angle), 0.7}, {0, 0, 0.05});
    const KeyframeId id(static_cast<uint32_t>(i));
    map.keyframes.Insert(id, {frame, frame / 30.0, 0, pose, features, {}, {}});
    ObjectSighting sighting;
    sighting.object = ObjectId(again);
    sighting.category_id = book.category_id;
    sighting.is_new = i % kImages == 0;
    sighting.timestamp = frame / 30.0;
    sighting.observation = {frame, id, Rigid3(), 0, *ProjectToBox(book.ellipsoid, pose, kCamera),
                            0.8,   0};
    sighting.landmarks = landmarks;
    UpdateObjects(map, std::span(&sighting, 1), {frame, frame / 30.0}, config);
  }
  return map;
}

TEST(Merging, WhatIsPassedTwiceBrieflyIsKnownByItsLandmarks) {
  const Map map = PassedTwice(15, {});
  ASSERT_EQ(map.objects.size(), 1U);
  const Object& book = map.objects.At(ObjectId(0));
  EXPECT_EQ(book.state, ObjectState::kMapped);
  EXPECT_LT((book.ellipsoid.center - Table()[2].ellipsoid.center).norm(), 0.02);
}

TEST(Merging, AMappedObjectKeepsItsId) {
  Map map = SplitMap(false);
  Object early = map.objects.At(ObjectId(0)), late = early;
  early.state = ObjectState::kInitialized;
  early.observations.resize(early.observations.size() / 2);
  late.observations.erase(
      late.observations.begin(),
      late.observations.begin() + static_cast<std::ptrdiff_t>(early.observations.size()));
  map.merged_objects = {};
  map.objects.MutableAt(ObjectId(0)) = early;
  map.objects.Insert(ObjectId(1), late);
  MergeDuplicates(map, {ObjectId(0)}, {});
  EXPECT_FALSE(map.objects.Contains(ObjectId(0)));
  ASSERT_TRUE(map.objects.Contains(ObjectId(1)));
  EXPECT_EQ(map.objects.At(ObjectId(1)).state, ObjectState::kMapped);
  EXPECT_EQ(*map.ResolveObject(ObjectId(0)), ObjectId(1));
}

// A thing that was taken for a bowl at first: both halves of its detections have both labels.
TEST(Merging, WhatIsGivenTwoLabelsBecomesOneOfTheCommonerClass) {
  for (const bool has_both : {true, false}) {
    Map map = SplitMap(false);
    Object early = map.objects.At(ObjectId(0)), late = early;
    const int category = early.category_id;
    early.observations.resize(early.observations.size() / 2);
    late.observations.erase(
        late.observations.begin(),
        late.observations.begin() + static_cast<std::ptrdiff_t>(early.observations.size()));
    early.category_id = category + 1;
    early.total_observations = 10;
    late.total_observations = 30;
    if (has_both) {
      early.shares = {{category, 0.4}, {category + 1, 0.6}};
      late.shares = {{category, 0.8}, {category + 1, 0.2}};
    }
    map.merged_objects = {};
    map.objects.MutableAt(ObjectId(0)) = early;
    map.objects.Insert(ObjectId(1), late);
    MergeDuplicates(map, {ObjectId(0)}, {});
    ASSERT_EQ(map.objects.size(), has_both ? 1u : 2u);
    if (!has_both) continue;
    const Object& joint = map.objects.At(ObjectId(0));
    EXPECT_EQ(joint.category_id, category);
    EXPECT_NEAR(joint.shares.at(0).share, (0.4 * 10 + 0.8 * 30) / 40, 1e-12);
  }
}

TEST(Merging, WhatHasFewLandmarksIsForgottenAndSoDoesThePaper) {
  ObjectsConfig paper;
  paper.model = ObjectMethod::kPaper;
  for (const Map& map : {PassedTwice(5, {}), PassedTwice(15, paper)}) {
    EXPECT_FALSE(map.objects.Contains(ObjectId(0)));
    ASSERT_TRUE(map.objects.Contains(ObjectId(1)));  // the second pass, still in view
    EXPECT_EQ(map.objects.At(ObjectId(1)).state, ObjectState::kTentative);
  }
}

TEST(Merging, ObjectsSeenSideBySideStayTwo) {
  EXPECT_EQ(SplitMap(true).objects.size(), 2U);  // although one is inside the other
}

TEST(Merging, VotesAdd) {
  Object object;
  object.landmarks = {LandmarkId(1), LandmarkId(5)};
  object.landmark_votes = {2, 3};
  AddVotes({LandmarkId(0), LandmarkId(5), LandmarkId(9)}, {1, 1, 1}, object);
  EXPECT_EQ(object.landmarks,
            (std::vector{LandmarkId(0), LandmarkId(1), LandmarkId(5), LandmarkId(9)}));
  EXPECT_EQ(object.landmark_votes, (std::vector<uint16_t>{1, 2, 4, 1}));
}

}  // namespace
}  // namespace oaslam
