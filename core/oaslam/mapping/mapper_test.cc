#include "oaslam/mapping/mapper.h"

#include <gtest/gtest.h>

#include "grey_scene.h"
#include "matchers.h"
#include "oaslam/objects/object_model.h"
#include "object_film.h"

namespace oaslam {
namespace {

constexpr uint32_t kFirstDrifted = 4;
const Eigen::Vector3d kDisplacement(0.2, 0.1, 0);  // world units

// A map with correct landmarks. Its first keyframes are correct, too; the others are displaced, as
// before a loop is closed.
Map DriftedMap(const synthetic::World& world) {
  Map map = synthetic::MakeMap(world, {}).map;
  for (const KeyframeId id : map.keyframes.Ids())
    if (id.value >= kFirstDrifted) {
      Rigid3& pose = map.keyframes.MutableAt(id).cam_from_world;
      pose = pose * Rigid3(Eigen::Quaterniond::Identity(), -kDisplacement);
    }
  return map;
}

// The detections of the object in the images of the displaced keyframes.
MapCommand SightingsOf(const synthetic::World& world, const synthetic::TrueObject& object) {
  Rng rng(3);
  MapCommand command;
  for (uint32_t k = kFirstDrifted; k < world.cam_from_world.size(); ++k) {
    command.frame_index = static_cast<int>(10 * k);
    ObjectSighting sighting;
    sighting.object = ObjectId(0);
    sighting.category_id = object.category_id;
    sighting.is_new = k == kFirstDrifted;
    sighting.timestamp = k;
    sighting.observation.frame_index = command.frame_index;
    sighting.observation.reference = KeyframeId(k);
    sighting.observation.score = 0.8;
    sighting.observation.box =
        synthetic::Detect({object}, world.cam_from_world[k], world.camera, {}, rng).at(0).box;
    command.sightings.push_back(sighting);
  }
  return command;
}

// Mean overlap of an ellipsoid, seen from the keyframes, with the boxes of the
// only object of a map.
double OverlapIn(const Map& map, const Ellipsoid& ellipsoid) {
  const Object& object = map.objects.At(ObjectId(0));
  return MeasureOverlap(ellipsoid, ViewsOf(map, object.observations), 0).mean_iou;
}

// The last bundle adjustment moves the keyframes back; the object must follow, although no image
// shows it again.
TEST(Mapper, TheLastOptimisationTakesObjectsAlong) {
  const synthetic::World world = synthetic::MakeWorld({.cameras = 24});
  const synthetic::TrueObject object = synthetic::Upright(5, {0.2, -0.1, 0.1}, {0.3, 0.2, 0.25});
  for (const BundleObjects objects :
       {BundleObjects::kNone, BundleObjects::kPoses, BundleObjects::kFull}) {
    SlamConfig config = SlamConfig::Offline();
    config.bundle.objects = objects;
    Mapper mapper(config, DriftedMap(world));
    mapper.Apply(SightingsOf(world, object));
    const auto before = mapper.Publish();
    const Ellipsoid drifted = before->objects.At(ObjectId(0)).ellipsoid;
    ASSERT_GT(OverlapIn(*before, drifted), 0.95) << static_cast<int>(objects);
    mapper.Finish();
    const auto after = mapper.Publish();
    ASSERT_LT(OverlapIn(*after, drifted), 0.85) << static_cast<int>(objects);
    EXPECT_GT(OverlapIn(*after, after->objects.At(ObjectId(0)).ellipsoid), 0.95)
        << static_cast<int>(objects);
  }
}

TEST(Mapper, DescribesKeyframesAndLetsTheirImagesGo) {
  const synthetic::World world = synthetic::MakeWorld({.cameras = 6});
  Map map = synthetic::MakeMap(world, {}).map;
  const GreyBuffer noise = synthetic::Noise(world.camera.width, world.camera.height, 1);
  for (const KeyframeId id : map.keyframes.Ids())
    if (id.value > 0) map.keyframes.MutableAt(id).image = std::make_shared<const GreyBuffer>(noise);
  Mapper mapper(SlamConfig::Offline(), std::move(map));
  mapper.Finish();
  const auto after = mapper.Publish();
  EXPECT_THAT(after->CheckInvariants(), IsEmpty());
  after->keyframes.ForEach([](KeyframeId id, const Keyframe& keyframe) {
    EXPECT_EQ(keyframe.image, nullptr);
    EXPECT_EQ(keyframe.features->learned.empty(), id.value == 0) << id.value;
  });
}

}  // namespace
}  // namespace oaslam
