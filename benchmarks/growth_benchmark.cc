// Measures whether the cost of a frame grows with the map: a camera moves along a wall, with maps
// of 50, 300 and 1000 keyframes; and a camera is relocalized by objects, with 1, 5 and 15 desks of
// 14 objects each.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>

#include "oaslam/matching/place_index.h"
#include "oaslam/relocalization/by_objects.h"
#include "oaslam/tracking/pose_tracking.h"
#include "object_film.h"
#include "synthetic_world.h"

namespace oaslam {
namespace {

constexpr double kStep = 0.15;  // between keyframes; the wall is 3 away and 3.7 of it are in view

Rigid3 PoseAt(double x) { return synthetic::LookAt({x, -3, 0}, {x, 0, 0}); }

struct Corridor {
  synthetic::World world;
  synthetic::MappedWorld mapped;
  Frame frame;
  double here = 0;

  explicit Corridor(int keyframes) {
    Rng rng(1);
    const double length = kStep * keyframes;
    // Ids ascend along the walk, as they do where landmarks are made on the way.
    const int count = static_cast<int>((length + 4) * 120);
    for (int i = 0; i < count; ++i) {
      world.points.emplace_back(-2 + (length + 4) * i / count, rng.Uniform(-0.5, 0.5),
                                rng.Uniform(-1.3, 1.3));
      world.descriptors.push_back(synthetic::RandomDescriptor(rng));
      world.max_distance.push_back(3 * std::pow(1.2, rng.Uniform(0, 4)));
      world.angles_rad.push_back(0);
    }
    for (int k = 0; k < keyframes; ++k) world.cam_from_world.push_back(PoseAt(k * kStep));
    mapped = synthetic::MakeMap(world, {});
    here = kStep * (keyframes / 2 + 0.4);
    frame.features = synthetic::MakeView(world, PoseAt(here), {}, rng).features;
  }
};

const Corridor& CorridorOf(int64_t keyframes) {
  static std::map<int64_t, std::unique_ptr<Corridor>> known;
  auto& corridor = known[keyframes];
  if (!corridor) corridor = std::make_unique<Corridor>(static_cast<int>(keyframes));
  return *corridor;
}

void TrackAFrame(benchmark::State& state) {
  const Corridor& c = CorridorOf(state.range(0));
  const Keyframe& last =
      c.mapped.map.keyframes.At(KeyframeId(static_cast<uint32_t>(state.range(0) / 2)));
  int inliers = 0;
  for (auto _ : state) {
    const TrackReport first = TrackFromLastFrame(c.frame, c.mapped.map, *last.features,
                                                 last.landmarks, PoseAt(c.here + 0.01), 15);
    inliers = TrackLocalMap(c.frame, c.mapped.map, first, {}).inliers;
  }
  state.counters["landmarks"] = static_cast<double>(c.mapped.map.landmarks.size());
  state.counters["inliers"] = inliers;
}
BENCHMARK(TrackAFrame)->Arg(50)->Arg(300)->Arg(1000)->Unit(benchmark::kMicrosecond);

// The cost of a snapshot for the mapper: the copy, and the pages that later edits have to copy.
void PublishAndEdit(benchmark::State& state, const std::vector<LandmarkId>& edited) {
  Map map = CorridorOf(state.range(0)).mapped.map;
  for (auto _ : state) {
    const auto snapshot = std::make_shared<const Map>(map);
    for (const LandmarkId id : edited)
      if (Landmark* landmark = map.landmarks.Mutable(id)) landmark->visible += 1;
    benchmark::DoNotOptimize(snapshot);
  }
}

// The edits of a local bundle adjustment: what the keyframe and its neighbours see.
void PublishASnapshot(benchmark::State& state) {
  const Map& map = CorridorOf(state.range(0)).mapped.map;
  const KeyframeId middle(static_cast<uint32_t>(state.range(0) / 2));
  std::vector<LandmarkId> edited = map.keyframes.At(middle).landmarks;
  for (const KeyframeId id : map.CovisibleKeyframes(middle, 24)) {
    const std::vector<LandmarkId>& seen = map.keyframes.At(id).landmarks;
    edited.insert(edited.end(), seen.begin(), seen.end());
  }
  PublishAndEdit(state, edited);
}
BENCHMARK(PublishASnapshot)->Arg(50)->Arg(300)->Arg(1000)->Unit(benchmark::kMicrosecond);

// The edits of a global bundle adjustment.
void PublishASnapshotOfAChangedMap(benchmark::State& state) {
  PublishAndEdit(state, CorridorOf(state.range(0)).mapped.map.landmarks.Ids());
}
BENCHMARK(PublishASnapshotOfAChangedMap)
    ->Arg(50)
    ->Arg(300)
    ->Arg(1000)
    ->Unit(benchmark::kMicrosecond);

void IndexThePlaces(benchmark::State& state) {
  const Map& map = CorridorOf(state.range(0)).mapped.map;
  for (auto _ : state) benchmark::DoNotOptimize(PlaceIndex(map).size());
}
BENCHMARK(IndexThePlaces)->Arg(50)->Arg(300)->Arg(1000)->Unit(benchmark::kMillisecond);

void FindThePlace(benchmark::State& state) {
  const Corridor& c = CorridorOf(state.range(0));
  const PlaceIndex index(c.mapped.map);
  for (auto _ : state)
    benchmark::DoNotOptimize(index.RankPlaces(c.mapped.map, index.Find(*c.frame.features), 5));
}
BENCHMARK(FindThePlace)->Arg(50)->Arg(300)->Arg(1000)->Unit(benchmark::kMicrosecond);

// Objects of six classes on desks that are 4 apart, arranged differently on each desk; the query
// shows the first desk.
std::vector<synthetic::TrueObject> Desks(int64_t count) {
  std::vector<synthetic::TrueObject> objects;
  for (int64_t desk = 0; desk < count; ++desk) {
    Rng rng(static_cast<uint64_t>(desk) + 1);
    for (int i = 0; i < 14; ++i) {
      const int category = i % 6;
      const double size = 0.05 + 0.02 * category;
      objects.push_back(
          synthetic::Upright(category,
                             {4.0 * static_cast<double>(desk % 4) + rng.Uniform(-0.8, 0.8),
                              4.0 * static_cast<double>(desk / 4) + rng.Uniform(-0.6, 0.6), size},
                             {size, size * rng.Uniform(0.7, 1), size}));
    }
  }
  return objects;
}

void FindTheCameraByObjects(benchmark::State& state) {
  const std::vector<synthetic::TrueObject> objects = Desks(state.range(0));
  Map map;
  map.cameras.push_back(synthetic::World().camera);
  map.up = Eigen::Vector3d::UnitZ();
  for (uint32_t i = 0; i < objects.size(); ++i) {
    Object object;
    object.category_id = objects[i].category_id;
    object.state = ObjectState::kMapped;
    object.ellipsoid = objects[i].ellipsoid;
    object.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 0.01, 0.01, 0.01, 0.1;
    map.objects.Insert(ObjectId(i), object);
  }
  Rng rng(6);
  const auto detections = synthetic::Detect(Desks(1), synthetic::OnCircle(0.7), map.cameras[0],
                                            {.box_px = 2, .miss_rate = 0.15}, rng);
  size_t candidates = 0;
  for (auto _ : state)
    candidates +=
        RelocalizeByObjects(detections, map.cameras[0], map, {}, std::nullopt, rng).size();
  state.counters["objects"] = static_cast<double>(map.objects.size());
  state.counters["boxes"] = static_cast<double>(detections.size());
  benchmark::DoNotOptimize(candidates);
}
BENCHMARK(FindTheCameraByObjects)->Arg(1)->Arg(5)->Arg(15)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace oaslam
