#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "oaslam/map/next_ids.h"
#include "oaslam/map/renumbering.h"
#include "oaslam/mapping/mapper.h"
#include "offline_config.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

const Eigen::Vector3d kMotion(10, 0, 0);  // world units

// A mapper whose adjustments in the background end only when the test says so, and move the whole
// map.
// One begins when a submap that shows the same scene is joined with the map.
class AdjustmentTest : public testing::Test {
 protected:
  AdjustmentTest() : map_(synthetic::MakeMap(synthetic::MakeWorld({}), {}).map) {}

  Mapper MapperOf(RunnerMode mode) {
    return Mapper(OfflineIn(mode), map_,
                  [this](const Map& map, const std::vector<KeyframeId>&, int, const BundleConfig&,
                         const std::stop_token&) {
                    ++begun_;
                    std::unique_lock lock(mutex_);
                    changed_.wait(lock, [&] { return may_end_; });
                    return MotionOf(map);
                  });
  }

  void LetItEnd() {
    const std::scoped_lock lock(mutex_);
    may_end_ = true;
    changed_.notify_all();
  }

  // A copy of the map of the scene, `copy` times as far behind in its ids.
  MapCommand Joining(uint32_t copy, int frame_index, const Similarity& where = {}) const {
    NextIds first = NextIdsOf(map_);
    first = {copy * first.keyframe, copy * first.landmark, copy * first.object};
    Renumbering numbers{.first = first, .cameras = map_.cameras, .camera_of = {0}};
    return {frame_index,
            JoiningMap{std::make_shared<const Map>(Renumbered({map_, {}}, numbers).map), where}};
  }

  // A keyframe that sees what the first one of the map sees.
  static MapCommand KeyframeOf(const Map& map, int frame_index) {
    const KeyframeId first = map.keyframes.First();
    const Keyframe& like = map.keyframes.At(first);
    TrackedFrame seen;
    seen.frame.index = frame_index;
    seen.frame.timestamp = frame_index;
    seen.frame.camera =
        std::make_shared<const Camera>(map.cameras[static_cast<size_t>(like.camera)]);
    seen.frame.features = like.features;
    seen.cam_from_world = like.cam_from_world;
    seen.reference = first;
    seen.landmarks = like.landmarks;
    return {frame_index, KeyframeInsertion{KeyframeId(NextIdsOf(map).keyframe), std::move(seen)}};
  }

  // How far a keyframe has moved.
  static double Moved(const Map& before, const Map& now, KeyframeId id) {
    return CenterDistance(now.keyframes.At(id).cam_from_world,
                          before.keyframes.At(id).cam_from_world);
  }

  static BundleCorrection MotionOf(const Map& map) {
    BundleCorrection correction;
    correction.success = true;
    map.keyframes.ForEach([&](KeyframeId id, const Keyframe& k) {
      correction.poses.emplace_back(
          id, k.cam_from_world * Rigid3(Eigen::Quaterniond::Identity(), -kMotion));
    });
    map.landmarks.ForEach([&](LandmarkId id, const Landmark& l) {
      correction.points.emplace_back(id, l.position + kMotion);
    });
    return correction;
  }

  Map map_;
  std::atomic<int> begun_ = 0;

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool may_end_ = false;
};

// This test does not end where a command waits for the adjustment. The map moves with a keyframe
// only: a lost camera makes none, and links other submaps to the map as it is.
TEST_F(AdjustmentTest, LiveNothingWaitsForIt) {
  Mapper mapper = MapperOf(RunnerMode::kLive);
  mapper.Apply(Joining(1, 0));
  const std::shared_ptr<const Map> before = mapper.Publish();
  const KeyframeId first = before->keyframes.First();
  MapCommand adopt{0, AdoptAdjustment{}};
  for (adopt.frame_index = 1; adopt.frame_index < 100; ++adopt.frame_index) mapper.Apply(adopt);
  mapper.Apply(KeyframeOf(*before, adopt.frame_index));
  EXPECT_LT(Moved(*before, *mapper.Publish(), first), 1);
  LetItEnd();
  int keyframes = 0;
  for (; keyframes < 1000; ++keyframes) {
    const std::shared_ptr<const Map> map = mapper.Publish();
    mapper.Apply(adopt);
    EXPECT_LT(Moved(*map, *mapper.Publish(), first), 1);
    mapper.Apply(KeyframeOf(*map, ++adopt.frame_index));
    if (Moved(*map, *mapper.Publish(), first) > 9) break;
    std::this_thread::yield();
  }
  EXPECT_LT(keyframes, 1000);
}

// A submap that is joined while an adjustment goes on does not stay behind where that ends. It does
// not wait for the end either.
TEST_F(AdjustmentTest, LiveItBeginsAnewWithASubmap) {
  Mapper mapper = MapperOf(RunnerMode::kLive);
  mapper.Apply(Joining(1, 0));
  while (begun_ < 1) std::this_thread::yield();
  // Too far away to be tied.
  mapper.Apply(
      Joining(2, 1, Similarity(1, Eigen::Quaterniond::Identity(), Eigen::Vector3d(500, 0, 0))));
  while (begun_ < 2) std::this_thread::yield();
  LetItEnd();
}

TEST_F(AdjustmentTest, ElseItIsAppliedAfterAFixedNumberOfFrames) {
  for (const RunnerMode mode : {RunnerMode::kSequential, RunnerMode::kLockstep}) {
    Mapper mapper = MapperOf(mode);
    mapper.Apply(Joining(1, 0));
    const std::shared_ptr<const Map> before = mapper.Publish();
    const KeyframeId first = before->keyframes.First();
    LetItEnd();
    MapCommand nothing;
    nothing.frame_index = 29;
    mapper.Apply(nothing);
    EXPECT_LT(Moved(*before, *mapper.Publish(), first), 1) << ToString(mode);
    nothing.frame_index = 30;
    mapper.Apply(nothing);
    EXPECT_GT(Moved(*before, *mapper.Publish(), first), 9) << ToString(mode);
  }
}

}  // namespace
}  // namespace oaslam
