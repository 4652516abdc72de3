#include "oaslam/objects/association.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "oaslam/geometry/box.h"
#include "oaslam/geometry/camera_model.h"
#include "oaslam/geometry/ellipsoid.h"
#include "object_table.h"

namespace oaslam {
namespace {

using namespace object_table;

TrackedFrame FrameWith(int index, std::vector<ObjectDetection> detections) {
  TrackedFrame tracked;
  tracked.frame.index = index;
  tracked.frame.timestamp = index / 30.0;
  tracked.frame.camera = std::make_shared<const Camera>(kCamera);
  tracked.frame.detections = std::move(detections);
  tracked.reference = KeyframeId(0);
  return tracked;
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
  return MappedObject(synthetic::Upright(41, center, {0.1, 0.1, 0.1}));
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
  // 6 of 20 columns are common to both: an overlap of exactly the least.
  const auto next =
      AssociateObjects(FrameWith(1, {{41, 0.9, {107, 100, 120, 110}, 0}}), map, first.tracks, {});
  ASSERT_EQ(IoU({100, 100, 113, 110}, {107, 100, 120, 110}), 0.3);
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
    Map map = EmptyMap(camera);
    const Eigen::Vector3d ray = RayOf(camera, {camera.cx, y});
    map.objects.Insert(ObjectId(7), MappedCup(4 * ray));
    TrackedFrame seen = FrameWith(0, {{1, 0.9, {10, 10, 60, 60}, 0}});
    seen.frame.camera = std::make_shared<const Camera>(camera);
    const auto found = AssociateObjects(seen, map, ObjectTracks::ContinueFrom(map), {});
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

}  // namespace
}  // namespace oaslam
