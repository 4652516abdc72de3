// rearrange_map IN OUT SEED [COPIES]: exchanges the places of the objects, which gives a wrong map
// that differs from the right one by their arrangement only. With COPIES, makes a large map with
// many objects of each class: the map itself and COPIES - 1 rearranged copies beside it.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cstdlib>
#include <utility>

#include "oaslam/error.h"
#include "oaslam/storage/map_file.h"
#include "oaslam/util/rng.h"

namespace oaslam {
namespace {

std::vector<Object> MappedObjects(const Map& map) {
  std::vector<Object> objects;
  map.objects.ForEach([&](ObjectId, const Object& object) {
    if (object.state == ObjectState::kMapped) objects.push_back(object);
  });
  return objects;
}

// No object keeps its place (Sattolo's cycle), but each keeps its height, so that objects stay on
// the table.
void ExchangePlaces(std::vector<Object>& objects, const Eigen::Vector3d& up, Rng& rng) {
  for (size_t i = objects.size(); i-- > 1;) {
    Eigen::Vector3d &a = objects[i].ellipsoid.center,
                    &b = objects[rng.Index(static_cast<int>(i))].ellipsoid.center;
    std::swap(a, b);
    const Eigen::Vector3d rise = up * up.dot(a - b);
    a -= rise;
    b += rise;
  }
}

double Extent(const std::vector<Object>& objects) {
  double extent = 0;
  for (const Object& a : objects)
    for (const Object& b : objects)
      extent = std::max(extent, (a.ellipsoid.center - b.ellipsoid.center).norm());
  return extent;
}

void Rearrange(Map& map, int copies, Rng& rng) {
  const std::vector<Object> original = MappedObjects(map);
  const Eigen::Vector3d up = map.up.value_or(-Eigen::Vector3d::UnitY()), side = up.unitOrthogonal(),
                        ahead = up.cross(side);
  const double spacing = 1.5 * Extent(original);
  uint32_t next = 0;
  for (const ObjectId id : map.objects.Ids()) {
    next = id.value + 1;
    map.objects.Erase(id);
  }
  const int columns = static_cast<int>(std::ceil(std::sqrt(copies)));
  for (int copy = 0; copy < copies; ++copy) {
    std::vector<Object> objects = original;
    if (copies == 1 || copy > 0) ExchangePlaces(objects, up, rng);
    for (Object& object : objects) {
      object.ellipsoid.center += spacing * (copy % columns * side + copy / columns * ahead);
      map.objects.Insert(ObjectId(next++), std::move(object));
    }
  }
}

}  // namespace
}  // namespace oaslam

int main(int argc, char** argv) {
  if (argc != 4 && argc != 5) return 2;
  try {
    oaslam::SavedMap saved = oaslam::LoadMap(argv[1]);
    oaslam::Rng rng(std::strtoull(argv[3], nullptr, 10));
    oaslam::Rearrange(saved.map, argc == 5 ? std::atoi(argv[4]) : 1, rng);
    oaslam::SaveMap(argv[2], saved);
  } catch (const oaslam::InputError& error) {
    fmt::print(stderr, "rearrange_map: {}\n", error.what());
    return 1;
  }
  return 0;
}
