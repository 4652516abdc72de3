// Memory runs out while the mapper works: in this program operator new fails
// when a test asks for it.

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <thread>
#include <vector>

#include "matchers.h"
#include "oaslam/mapping/background_bundle.h"
#include "oaslam/system/atlas.h"
#include "oaslam/system/map_pipeline.h"
#include "offline_config.h"
#include "synthetic_world.h"

namespace {

// The number of allocations before all further ones fail, on every thread except the caller's.
// Below zero: they never fail.
std::atomic<int64_t> g_left = -1;
std::atomic<std::thread::id> g_spared;

bool Fails() {
  if (g_left.load(std::memory_order_relaxed) < 0 || std::this_thread::get_id() == g_spared.load())
    return false;
  int64_t left = g_left.load();
  while (left > 0 && !g_left.compare_exchange_weak(left, left - 1)) {
  }
  return left == 0;
}

class MemoryRunsOut {
 public:
  explicit MemoryRunsOut(int64_t allocations, std::thread::id spared = std::this_thread::get_id()) {
    g_spared = spared;
    g_left = allocations;
  }
  ~MemoryRunsOut() { g_left = -1; }
  MemoryRunsOut(const MemoryRunsOut&) = delete;
  MemoryRunsOut& operator=(const MemoryRunsOut&) = delete;
};

}  // namespace

// All forms but the aligned ones, which stay the library's and never fail: memory from a form of
// the sanitizer's must not be freed by one of these. Inlined, GCC takes a pair for a mismatch of
// new and free.
[[gnu::noinline]] void* operator new(size_t size, const std::nothrow_t&) noexcept {
  return Fails() ? nullptr : std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void* operator new(size_t size) {
  void* memory = operator new(size, std::nothrow);
  if (!memory) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void* operator new[](size_t size) { return operator new(size); }
[[gnu::noinline]] void* operator new[](size_t size, const std::nothrow_t&) noexcept {
  return operator new(size, std::nothrow);
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete[](void* memory, size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}
[[gnu::noinline]] void operator delete[](void* memory, const std::nothrow_t&) noexcept {
  std::free(memory);
}

namespace oaslam {
namespace {

using synthetic::EmptyMap;

Map MapOfKeyframes(const std::vector<uint32_t>& ids) {
  Map map = EmptyMap();
  for (const uint32_t id : ids)
    map.keyframes.Insert(KeyframeId(id), synthetic::BlankKeyframe(Rigid3()));
  return map;
}

Frame View(const synthetic::World& world, int index, Rng& rng) {
  const Rigid3 pose = synthetic::PoseOnArc({}, -20 + 0.8 * index);
  Frame frame = MakeFrame(synthetic::MakeView(world, pose, {.missed = 0.1}, rng), index);
  frame.motion = synthetic::TrueMotion(index, pose);
  return frame;
}

void ExpectBadAlloc(const std::exception_ptr& failure) {
  ASSERT_TRUE(failure);
  EXPECT_THROW(std::rethrow_exception(failure), std::bad_alloc);
}

// Whenever it happens, the map is consistent and as large as before, no call waits for ever, and
// the poses so far are known.
TEST(MappingFailure, TheMapUpToThereIsKept) {
  const synthetic::World world = synthetic::MakeWorld({});
  for (const RunnerMode mode : {RunnerMode::kLockstep, RunnerMode::kLive})
    for (const int64_t allocations : {0, 1, 30, 300, 1500}) {
      Atlas atlas(OfflineIn(mode), EmptyMap(), false, {});
      Rng rng(7);
      int frame = 0;
      for (; frame < 30; ++frame) {
        atlas.Process(View(world, frame, rng));
        if (mode == RunnerMode::kLive) atlas.main().Newest();
      }
      const size_t keyframes = atlas.main().Newest()->keyframes.size();
      ASSERT_GE(keyframes, 3U) << ToString(mode);
      {
        const MemoryRunsOut out(allocations);
        for (; frame < 60 && !atlas.failure(); ++frame) {
          atlas.Process(View(world, frame, rng));
          if (mode == RunnerMode::kLive) atlas.main().Newest();
        }
      }
      ExpectBadAlloc(atlas.failure());
      EXPECT_LT(frame, 60) << ToString(mode) << ' ' << allocations;
      atlas.Process(View(world, frame, rng));
      atlas.Finish();
      const Map& map = *atlas.main().snapshot();
      EXPECT_THAT(map.CheckInvariants(), IsEmpty()) << ToString(mode) << ' ' << allocations;
      EXPECT_GE(map.keyframes.size() + map.retired.size(), keyframes);
      size_t poses = 0;
      for (const FramePose& pose : atlas.main().tracker().trajectory())
        poses += map.ResolvePose(pose.reference).has_value();
      EXPECT_GE(poses, 25U) << ToString(mode) << ' ' << allocations;
      ExpectBadAlloc(atlas.failure());
    }
}

// The tracker's poses and the map have one unit, also where memory runs out while it changes.
TEST(MappingFailure, InAChangeOfTheUnitTheUnitStays) {
  constexpr double kMetres = 2;
  constexpr int kLast = 29;
  const synthetic::World world = synthetic::MakeWorld({});
  int failures = 0;
  for (const int64_t allocations : {0, 1, 10, 100}) {
    Atlas atlas(SlamConfig::Offline(), EmptyMap(), false, {});
    Rng rng(7);
    for (int frame = 0; frame <= kLast; ++frame) atlas.Process(View(world, frame, rng));
    const Session& session = atlas.main();
    const auto before = session.tracker().PoseOf(kLast, *session.snapshot());
    ASSERT_TRUE(before);
    {
      const MemoryRunsOut out(allocations);
      atlas.SetMetresPerUnit(kMetres);
    }
    failures += atlas.failure() != nullptr;
    EXPECT_EQ(session.snapshot()->is_metric, !atlas.failure()) << allocations;
    const double scale = atlas.failure() ? 1 : kMetres;
    const auto after = session.tracker().PoseOf(kLast, *session.snapshot());
    ASSERT_TRUE(after);
    EXPECT_NEAR(after->translation.norm(), scale * before->translation.norm(),
                0.01 * scale * before->translation.norm())
        << allocations;
  }
  EXPECT_GE(failures, 2);
}

TEST(MappingFailure, WhatIsSubmittedLaterIsDropped) {
  for (const RunnerMode mode :
       {RunnerMode::kSequential, RunnerMode::kLockstep, RunnerMode::kLive}) {
    MapPipeline pipeline(OfflineIn(mode), MapOfKeyframes({5}));
    MapCommand nothing;
    pipeline.Submit(nothing);
    EXPECT_EQ(pipeline.Newest()->version, 2U);
    EXPECT_FALSE(pipeline.failure());
    // Violates an invariant: no two submaps share an id.
    pipeline.Submit(
        {.edit = JoiningMap{std::make_shared<const Map>(MapOfKeyframes({3, 5})), Similarity()},
         .is_urgent = true});
    EXPECT_EQ(pipeline.Newest()->version, 2U) << ToString(mode);
    EXPECT_EQ(pipeline.Newest()->keyframes.Ids(), std::vector{KeyframeId(5)}) << ToString(mode);
    ASSERT_TRUE(pipeline.failure()) << ToString(mode);
    EXPECT_THROW(std::rethrow_exception(pipeline.failure()), std::logic_error);
    for (int i = 0; i < 20; ++i) {
      nothing.is_urgent = i % 2 == 0;
      pipeline.Submit(nothing);
    }
    EXPECT_EQ(pipeline.SnapshotFor(1000)->version, 2U) << ToString(mode);
    EXPECT_EQ(pipeline.Finish()->version, 2U) << ToString(mode);
  }
}

TEST(MappingFailure, OfTheLastOptimisationLeavesTheMapAsItWas) {
  const synthetic::World world = synthetic::MakeWorld({});
  MapPipeline pipeline(OfflineIn(), synthetic::MakeMap(world, {.position_noise = 0.02}).map);
  const auto before = pipeline.Newest();
  std::shared_ptr<const Map> after;
  {
    const MemoryRunsOut out(200, std::thread::id());
    after = pipeline.Finish();
  }
  EXPECT_EQ(after, before);
  ExpectBadAlloc(pipeline.failure());
}

TEST(MappingFailure, OfTheBackgroundBundleIsTold) {
  const synthetic::World world = synthetic::MakeWorld({});
  Map map = synthetic::MakeMap(world, {.position_noise = 0.02}).map;
  const MemoryRunsOut out(20);
  BackgroundBundle bundle(map, map.keyframes.Ids(), BundleConfig{}, 0);
  EXPECT_THROW(bundle.WaitAndApply(map), std::bad_alloc);
}

}  // namespace
}  // namespace oaslam
