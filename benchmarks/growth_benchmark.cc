// Measures how costs grow with the map: a building (tests/synthetic_building.h) of 100, 1000 and
// 10,000 keyframes with 20, 300 and 2000 objects. Medians, in the counter `ms`; tools/growth makes
// a table.
#include <benchmark/benchmark.h>
#include <malloc.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "oaslam/map/next_ids.h"
#include "oaslam/mapping/background_bundle.h"
#include "oaslam/mapping/loop_closing.h"
#include "oaslam/mapping/mapper.h"
#include "oaslam/relocalization/by_points.h"
#include "oaslam/relocalization/relocalizer.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/tracking/tracker.h"
#include "synthetic_building.h"

namespace oaslam {
namespace {

using synthetic::Building;

const Building& BuildingOf(int64_t keyframes, int64_t objects, bool is_loop = false) {
  static std::map<std::tuple<int64_t, int64_t, bool>, std::unique_ptr<Building>> known;
  auto& building = known[{keyframes, objects, is_loop}];
  if (!building)
    building = std::make_unique<Building>(synthetic::BuildingOptions{
        static_cast<int>(keyframes), static_cast<int>(objects), is_loop, !is_loop});
  return *building;
}

const Building& BuildingOf(const benchmark::State& state) {
  return BuildingOf(state.range(0), state.range(1));
}

// Allocated memory. mallinfo counts large blocks separately.
double AllocatedBytes() {
  const auto info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

// CPU time of a call, ms: of this thread only. Other programs of the machine hardly change it.
template <typename Call>
double Timed(Call&& call) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
  };
  const double begin = now();
  call();
  return now() - begin;
}

// Wall time of a call, ms.
template <typename Call>
double WallTimed(Call&& call) {
  const auto begin = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
      .count();
}

class Median {
 public:
  void Add(double value) { values_.push_back(value); }
  void Report(benchmark::State& state) {
    std::ranges::sort(values_);
    state.counters["ms"] = values_[values_.size() / 2];
    state.counters["worst_ms"] = values_.back();
  }

 private:
  std::vector<double> values_;
};

void SetBytes(const std::string& path, benchmark::State& state) {
  state.counters["bytes"] = static_cast<double>(std::filesystem::file_size(path));
}

std::string FileOf(const benchmark::State& state) {
  return (std::filesystem::temp_directory_path() /
          ("oaslam_growth_" + std::to_string(state.range(0)) + ".map"))
      .string();
}

constexpr int kFramesPerKeyframe = Building::kFramesPerKeyframe;
constexpr double kStart = 0.4;  // the place of the measurements, as a share of the walk

// An image, from its features to its pose and its objects.
void TrackAnImage(benchmark::State& state) {
  const Building& building = BuildingOf(state);
  const Map& map = building.map();
  Tracker tracker(SlamConfig::Offline(), true);
  NextIds ids = NextIdsOf(map);
  const TrackingContext context{
      .use = MapUse::kRead, .next_keyframe = &ids.keyframe, .next_object = &ids.object};
  Rng rng(5);
  Median median;
  const double start = building.DeskNear(kStart * static_cast<double>(state.range(0))) - 5;
  int tracked = 0, images = 0;
  for (auto _ : state) {
    Frame frame =
        building.FrameAt(start + static_cast<double>(images) / kFramesPerKeyframe, rng).frame;
    frame.index = images++;
    TrackingStep step;
    const double ms = Timed([&] { step = tracker.Track(frame, map, context); });
    tracked += step.pose.state == TrackingState::kTracking;
    if (images > 1) median.Add(ms);  // the first is relocalized
    tracker.TakeRest();
  }
  state.counters["tracked"] = static_cast<double>(tracked) / (images - 1);
  median.Report(state);
}

// The mapper's work for a keyframe, and its snapshot; ten images were tracked since the last
// keyframe.
void MapAKeyframe(benchmark::State& state) {
  const Building& building = BuildingOf(state);
  SlamConfig config = SlamConfig::Offline();
  Map map = building.map();
  Rng rng(6);
  ObjectTracks tracks = ObjectTracks::ContinueFrom(map);
  const auto keyframes = static_cast<uint32_t>(state.range(0));
  const double start = building.DeskNear(kStart * static_cast<double>(state.range(0))) - 10;
  Mapper mapper(config, std::move(map));
  std::shared_ptr<const Map> snapshot = mapper.Publish();
  Median median;
  uint32_t made = 0;
  for (auto _ : state) {
    MapCommand command;
    // Frames count on from those of the map.
    const int first_frame = static_cast<int>(kFramesPerKeyframe * (keyframes + made));
    for (int i = 0; i < kFramesPerKeyframe; ++i) {
      TrackedFrame seen =
          building.FrameAt(start + made + static_cast<double>(i) / kFramesPerKeyframe, rng);
      seen.frame.index = first_frame + i;
      seen.frame.timestamp = seen.frame.index * kVideoInterval;
      seen.cam_from_reference =
          seen.cam_from_world * snapshot->ResolvePose(seen.reference)->Inverse();
      ObjectAssociation association = AssociateObjects(seen, *snapshot, tracks, config.objects);
      tracks = std::move(association.tracks);
      for (ObjectSighting& sighting : association.sightings)
        command.sightings.push_back(std::move(sighting));
      if (i + 1 < kFramesPerKeyframe) continue;
      command.frame_index = seen.frame.index;
      command.edit = KeyframeInsertion{KeyframeId(keyframes + made), std::move(seen)};
    }
    ++made;
    median.Add(Timed([&] {
      mapper.Apply(command);
      snapshot = mapper.Publish();
    }));
  }
  state.counters["keyframes"] = static_cast<double>(snapshot->keyframes.size());
  median.Report(state);
}

void Relocalize(benchmark::State& state, RelocalizationMode mode, bool with_gravity) {
  const Building& building = BuildingOf(state);
  Relocalizer relocalizer{SlamConfig::Offline()};
  Rng rng(7);
  Median median;
  int found = 0, asked = 0;
  double index_ms = 0;
  for (auto _ : state) {
    const double desk =
        building.DeskNear((0.05 + 0.9 * rng.Uniform(0, 1)) * static_cast<double>(state.range(0)));
    TrackedFrame frame = building.FrameAt(desk, rng);
    frame.frame.gravity_in_cam.reset();
    if (with_gravity)
      frame.frame.gravity_in_cam = frame.cam_from_world.rotation * Eigen::Vector3d(0, 0, -1);
    Relocalization result;
    const double ms =
        Timed([&] { result = relocalizer.Find(frame.frame, building.map(), mode, rng); });
    if (asked++ == 0)
      index_ms = ms;  // the index of places is made
    else
      median.Add(ms);
    found +=
        result.IsFound() &&
        (result.cam_from_world.OriginInSource() - frame.cam_from_world.OriginInSource()).norm() <
            0.2;
  }
  state.counters["found"] = static_cast<double>(found) / asked;
  state.counters["first_ms"] = index_ms;
  median.Report(state);
}

void FindByPoints(benchmark::State& state) {
  Relocalize(state, RelocalizationMode::kPoints, false);
}
void FindByObjects(benchmark::State& state) {
  Relocalize(state, RelocalizationMode::kObjects, false);
}
void FindByObjectsWithGravity(benchmark::State& state) {
  Relocalize(state, RelocalizationMode::kObjects, true);
}

// Without the network.
void FindByLearned(benchmark::State& state) {
  const Building& building = BuildingOf(state);
  const PlaceIndex index(building.map());
  Rng rng(7);
  Median median;
  int found = 0, asked = 0;
  for (auto _ : state) {
    const double place = (0.05 + 0.9 * rng.Uniform(0, 1)) * static_cast<double>(state.range(0));
    TrackedFrame seen = building.FrameAt(place, rng);
    Features features = *seen.frame.features;
    features.learned.descriptors = features.descriptors;
    for (int k = 0; k < features.size(); ++k)
      features.learned.keypoints.push_back(static_cast<uint16_t>(k));
    seen.frame.features = std::make_shared<const Features>(std::move(features));
    median.Add(Timed([&] {
      found += RelocalizeByPoints(seen.frame, building.map(), index, {}, rng, Appearance::kLearned)
                   .IsFound();
    }));
    ++asked;
  }
  state.counters["found"] = static_cast<double>(found) / asked;
  median.Report(state);
}

// A loop through the whole map: found, corrected, and adjusted in the background.
void CloseALoop(benchmark::State& state) {
  const Building& building = BuildingOf(state.range(0), state.range(1), true);
  const auto last = static_cast<uint32_t>(state.range(0) - 1);
  Median correction;
  bool is_found = false;
  double adjustment = 0;
  for (auto _ : state) {
    Map map = building.map();
    LoopDetector detector;
    Rng rng(8);
    std::optional<LoopClosure> loop;
    for (uint32_t k = last - 48; k <= last && !loop; ++k)
      loop = detector.Detect(map, KeyframeId(k), rng);
    is_found = loop.has_value();
    if (!loop) continue;
    correction.Add(Timed([&] { CorrectLoop(*loop, map); }));
    for (const std::vector<KeyframeId>& window : AdjustmentWindows(map))
      adjustment = std::max(adjustment, WallTimed([&] {
                              BackgroundBundle bundle(map, window, BundleConfig{}, 0);
                              bundle.WaitAndApply(map);
                            }));
  }
  state.counters["found"] = is_found;
  state.counters["adjustment_ms"] = adjustment;
  if (is_found) correction.Report(state);
}

void Save(benchmark::State& state) {
  Median median;
  for (auto _ : state)
    median.Add(Timed([&] { SaveMap(FileOf(state), {BuildingOf(state).map(), {}, {}}); }));
  SetBytes(FileOf(state), state);
  median.Report(state);
}

// From a saved map to the first pose in it.
void OpenToTheFirstPose(benchmark::State& state) {
  const Building& building = BuildingOf(state);
  if (!std::filesystem::exists(FileOf(state))) SaveMap(FileOf(state), {building.map(), {}, {}});
  Rng rng(9);
  Median load, first;
  bool is_found = false;
  for (auto _ : state) {
    const TrackedFrame frame =
        building.FrameAt(building.DeskNear(kStart * static_cast<double>(state.range(0))), rng);
    const double before = AllocatedBytes();
    SavedMap saved;
    const double load_ms = WallTimed([&] { saved = LoadMap(FileOf(state)); });
    const double loaded = AllocatedBytes();
    state.counters["memory"] = loaded - before;
    load.Add(load_ms);
    Relocalizer relocalizer{SlamConfig::Offline()};
    first.Add(load_ms + WallTimed([&] {
                is_found =
                    relocalizer
                        .Find(frame.frame, saved.map, RelocalizationMode::kPointsAndObjects, rng)
                        .IsFound();
              }));
    state.counters["index_memory"] = AllocatedBytes() - loaded;
  }
  load.Report(state);
  state.counters["load_ms"] = state.counters["ms"];
  first.Report(state);
  state.counters["found"] = is_found;
}

void Sizes(benchmark::internal::Benchmark* b) {
  b->Args({100, 20})->Args({1000, 300})->Args({10000, 2000})->Unit(benchmark::kMillisecond);
}
BENCHMARK(TrackAnImage)->Apply(Sizes)->Iterations(100);
BENCHMARK(MapAKeyframe)->Apply(Sizes)->Iterations(60);
BENCHMARK(FindByPoints)->Apply(Sizes)->Iterations(41);
BENCHMARK(FindByLearned)->Apply(Sizes)->Iterations(41);
BENCHMARK(FindByObjects)->Apply(Sizes)->Iterations(41);
BENCHMARK(FindByObjectsWithGravity)->Apply(Sizes)->Iterations(41);
BENCHMARK(CloseALoop)->Apply(Sizes)->Iterations(1);
BENCHMARK(Save)->Apply(Sizes)->Iterations(1);
BENCHMARK(OpenToTheFirstPose)->Apply(Sizes)->Iterations(3);

}  // namespace
}  // namespace oaslam
